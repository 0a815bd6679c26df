"""The room of targets: a painted EXR becomes a `Target`, an image with importance."""
