"""The rig of a painted scene: where its lights hang, and their planes while they are moved."""
