# SPDX-License-Identifier: GPL-3.0-or-later
"""Images that are open in Blender as files, without changing what Blender knows of them."""

import array
import os
import struct
import zlib

import bpy

#: Kinds of images that have no picture of their own to paint on.
NO_PICTURES = ("RENDER_RESULT", "COMPOSITING")

#: File formats that lightpaint reads; of others the pixels are written.
FORMATS = ("PNG", "TIFF", "JPEG", "OPEN_EXR")


def edited_image(context):
    """Return the image in the image editor, the largest if there are several; None if none."""
    space = context.space_data
    if space is not None and space.type == "IMAGE_EDITOR" and is_picture(space.image):
        return space.image
    areas = sorted(context.screen.areas, key=lambda area: -area.width * area.height)
    spaces = [area.spaces.active for area in areas if area.type == "IMAGE_EDITOR"]
    painted = [context.tool_settings.image_paint.canvas]
    images = [*(space.image for space in spaces), *painted]
    return next((image for image in images if is_picture(image)), None)


def is_picture(image):
    """Return whether there is an image, with pixels."""
    if image is None or image.type in NO_PICTURES:
        return False
    return image.has_data or bool(image.filepath)


def image_file(image, folder):
    """Return the path of a file with an image's pixels, in this folder unless it has one already.

    Raises ValueError for an image that has no pixels.
    """
    path = bpy.path.abspath(image.filepath_raw, library=image.library)
    is_saved = image.source == "FILE" and not image.is_dirty and not image.packed_file
    if is_saved and image.file_format in FORMATS and os.path.isfile(path):
        return path
    width, height = image.size
    if not width or not height or image.channels not in (3, 4):
        raise ValueError(f"the image {image.name} has no pixels: is its file missing?")
    pixels = array.array("f", [0.0]) * (width * height * image.channels)
    image.pixels.foreach_get(pixels)
    suffix, encode = (".exr", exr_bytes) if image.is_float else (".png", png_bytes)
    target = os.path.join(folder, f"painting{suffix}")
    with open(target, "wb") as file:
        file.write(encode(pixels, width, height, image.channels))
    return target


def png_bytes(pixels, width, height, channels):
    """Return a PNG of 16 bits of display values 0 to 1, the lowest row first."""
    scale, row = 65535, width * channels
    values = array.array("H", [min(max(round(v * scale), 0), scale) for v in pixels])
    values.byteswap()  # PNG has the most significant byte first
    rows = [b"\0" + values[y * row : (y + 1) * row].tobytes() for y in range(height - 1, -1, -1)]
    header = struct.pack(">IIBBBBB", width, height, 16, 6 if channels == 4 else 2, 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(b"".join(rows), 1)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in parts
    )


def exr_bytes(pixels, width, height, channels):
    """Return an uncompressed EXR of linear light in float32; pixels begin with the lowest row."""
    names = "ABGR" if channels == 4 else "BGR"
    listed = b"".join(name.encode() + b"\0" + struct.pack("<IIII", 2, 0, 1, 1) for name in names)
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    attributes = (
        ("channels", "chlist", listed + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<ff", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    )
    head = b"\x76\x2f\x31\x01" + struct.pack("<I", 2)
    for name, kind, data in attributes:
        head += f"{name}\0{kind}\0".encode() + struct.pack("<I", len(data)) + data
    head += b"\0"
    size = 4 * width * len(names)
    first = len(head) + 8 * height
    offsets = struct.pack(f"<{height}Q", *(first + y * (size + 8) for y in range(height)))
    rows = []
    for y in range(height):
        start = (height - 1 - y) * width * channels
        line = pixels[start : start + width * channels]
        planes = b"".join(line["RGBA".index(name) :: channels].tobytes() for name in names)
        rows.append(struct.pack("<ii", y, size) + planes)
    return head + offsets + b"".join(rows)
