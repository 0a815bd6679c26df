"""Picture files: OpenEXR and PNG in and out; JPEG, TIFF, PSD and layered files in."""
