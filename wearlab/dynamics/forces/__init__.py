"""What is read off a response: forces of the meshes, their extremes, accelerations, the balance of energy."""
