"""Forces and accelerations of meshes in a response, and its balance of energy."""
