"""What is read off a response: forces and accelerations of the meshes, their extremes, the balance of energy."""
