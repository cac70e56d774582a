"""What is read off a response: forces and accelerations of meshes, their extremes, the balance of energy."""
