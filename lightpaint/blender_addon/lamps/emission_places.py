# SPDX-License-Identifier: GPL-3.0-or-later
"""The places in Blender's data where a light has its level and its colour.

Each place reads and writes [level, red, green, blue]:

    a lamp                        energy and colour
    a shader, nothing linked      strength and colour
    a shader with linked strength colour alone
    a shader with linked colour   a multiplication, which is put in front of it while it is not 1
"""

from .lamp_units import scaled, scaled_colour

#: Name of the nodes that multiply a colour which other nodes make.
MULTIPLIER_NAME = "lightpaint multiplier"

#: Shader nodes that emit: sockets that may hold their colour, and their strength.
EMITTING_NODES = {
    "EMISSION": (("Color",), "Strength"),
    "BACKGROUND": (("Color",), "Strength"),
    "BSDF_PRINCIPLED": (("Emission Color", "Emission"), "Emission Strength"),
    "PRINCIPLED_VOLUME": (("Emission Color",), "Emission Strength"),
}


class LampEmission:
    """Energy and colour of a lamp."""

    slot: str = "lamp"
    paths: tuple[str, ...] = ("energy", "color")

    def __init__(self, owner):
        self.owner = owner

    def values(self):
        """Return level and colour."""
        return [self.owner.energy, *self.owner.color]

    def assign(self, values):
        """Set level and colour."""
        self.owner.energy, self.owner.color = values[0], values[1:]

    def scaled(self, base, factor, space=None):
        """Return level and colour for a multiplier of each channel. space: see working_space.py."""
        return scaled(base, factor, space)

    def animated_target(self):
        """Return the data that has these properties' animation, and the paths there."""
        return self.owner, self.paths

    def make_keyable(self):
        """Make sure there is something that can be keyed: there is."""


class PlainColour(LampEmission):
    """The colour of a world without nodes."""

    slot, paths = "colour", ("color",)

    def values(self):
        return [1.0, *self.owner.color]

    def assign(self, values):
        self.owner.color = values[1:]

    def scaled(self, base, factor, space=None):
        return scaled_colour(base, factor, space)


class NodeEmission:
    """Strength and colour of a shader node. owner: the material or the world of its tree."""

    def __init__(self, owner, node):
        self.owner, self.slot = owner, node.name
        names, strength = EMITTING_NODES[node.type]
        self.colour = next(node.inputs[name] for name in names if name in node.inputs)
        self.strength = node.inputs.get(strength)
        self.has_strength = self.strength is not None and not self.strength.is_linked
        self.multiplier = _multiplier_before(self.colour)
        self.is_textured = self.colour.is_linked

    def values(self):
        if self.is_textured:
            node = self.multiplier
            return [1.0, *(node.inputs[1].default_value if node else (1.0, 1.0, 1.0))]
        level = self.strength.default_value if self.has_strength else 1.0
        return [level, *self.colour.default_value[:3]]

    def assign(self, values):
        if self.is_textured:
            self._multiply(values[1:])
            return
        if self.has_strength:
            self.strength.default_value = values[0]
        self.colour.default_value = [*values[1:], self.colour.default_value[3]]

    def scaled(self, base, factor, space=None):
        has_level = self.has_strength and not self.is_textured
        return (scaled if has_level else scaled_colour)(base, factor, space)

    def animated_target(self):
        if self.is_textured:
            sockets = [self.multiplier.inputs[1]] if self.multiplier else []
            return self.owner.node_tree, tuple(s.path_from_id("default_value") for s in sockets)
        sockets = [self.colour, *[self.strength] * self.has_strength]
        return self.owner.node_tree, tuple(s.path_from_id("default_value") for s in sockets)

    def make_keyable(self):
        """Make sure there is something that can be keyed."""
        if self.is_textured and self.multiplier is None:
            self._add_multiplier()

    def _multiply(self, factor):
        """Put a multiplication before the colour, change it, or take it away if it is 1."""
        tree, is_one = self.owner.node_tree, list(factor) == [1.0, 1.0, 1.0]
        if self.multiplier is None:
            if is_one:
                return
            self._add_multiplier()
        factor_socket = self.multiplier.inputs[1]
        factor_socket.default_value = factor
        if is_one and factor_socket.path_from_id("default_value") not in animated_paths(tree):
            tree.links.new(self.multiplier.inputs[0].links[0].from_socket, self.colour)
            tree.nodes.remove(self.multiplier)
            self.multiplier = None

    def _add_multiplier(self):
        tree = self.owner.node_tree
        node = tree.nodes.new("ShaderNodeVectorMath")
        node.name = node.label = MULTIPLIER_NAME
        node.operation = "MULTIPLY"
        node.inputs[1].default_value = (1.0, 1.0, 1.0)
        place = self.colour.node.location
        node.location = (place.x - 200, place.y - 150)
        tree.links.new(self.colour.links[0].from_socket, node.inputs[0])
        tree.links.new(node.outputs[0], self.colour)
        self.multiplier = node


def _multiplier_before(socket):
    """Return the multiplication that lightpaint has put before a socket, or None."""
    if not socket.is_linked:
        return None
    node = socket.links[0].from_node
    is_ours = node.type == "VECT_MATH" and node.label == MULTIPLIER_NAME
    return node if is_ours and node.inputs[0].is_linked else None


def animated_paths(owner):
    """Return the paths of a piece of data that keyframes or drivers decide."""
    return {curve.data_path for curve in [*action_curves(owner), *driver_curves(owner)]}


def driver_curves(owner):
    """Return the drivers of a piece of data."""
    animation = getattr(owner, "animation_data", None)
    return list(animation.drivers) if animation else []


def action_curves(owner):
    """Return the keyframe curves of a piece of data, of old actions and of those in layers."""
    animation = getattr(owner, "animation_data", None)
    action = animation.action if animation else None
    if action is None:
        return []
    if hasattr(action, "fcurves"):
        return list(action.fcurves)
    bag = channel_bag(animation)
    return list(bag.fcurves) if bag else []


def channel_bag(animation):
    """Return the curves of the slot that animates this data, from Blender 5 on; None if none."""
    slot = animation.action_slot
    for layer in animation.action.layers:
        for strip in layer.strips:
            if slot and (bag := strip.channelbag(slot)):
                return bag
    return None


def remove_curves(owner, paths):
    """Delete the keyframe curves of some paths, and the action if it has no others."""
    animation = getattr(owner, "animation_data", None)
    action = animation.action if animation else None
    if action is None:
        return
    holder = action if hasattr(action, "fcurves") else channel_bag(animation)
    for curve in list(holder.fcurves) if holder else []:
        if curve.data_path in paths:
            holder.fcurves.remove(curve)
