# SPDX-License-Identifier: GPL-3.0-or-later
"""Emitters of a scene: lamps, meshes with emission, the world; the places in Blender's data where
they have their level and their colour; and what cannot be changed.

Each place reads and writes [level, red, green, blue]:

    a lamp                        energy and colour
    a shader, nothing linked      strength and colour
    a shader with linked strength colour alone
    a shader with linked colour   a multiplication, which is put in front of it while it is not 1

Linked data, drivers, keyframes of others, emission inside node groups, and lamps at zero or below
stay as they are. Their light is not a light group's, so the painter holds it as `rest`.
"""

from dataclasses import dataclass, field

from .lamp_units import scaled, scaled_colour
from .memory import recall

#: Name of the nodes that multiply a colour which other nodes make.
MULTIPLIER_NAME = "lightpaint multiplier"

#: Shader nodes that emit: sockets that may hold their colour, and their strength.
EMITTING_NODES = {
    "EMISSION": (("Color",), "Strength"),
    "BACKGROUND": (("Color",), "Strength"),
    "BSDF_PRINCIPLED": (("Emission Color", "Emission"), "Emission Strength"),
    "PRINCIPLED_VOLUME": (("Emission Color",), "Emission Strength"),
}

#: Key of an object's or world's memory with the paths that lightpaint has keyed.
KEYED = "keyed"


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

    def scaled(self, base, factor):
        """Return level and colour for a multiplier of each channel."""
        return scaled(base, factor)

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

    def scaled(self, base, factor):
        return scaled_colour(base, factor)


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

    def scaled(self, base, factor):
        has_level = self.has_strength and not self.is_textured
        return (scaled if has_level else scaled_colour)(base, factor)

    def animated_target(self):
        if self.is_textured:
            sockets = [self.multiplier.inputs[1]] if self.multiplier else []
        else:
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
    holder = curve_holder(owner)
    return list(holder.fcurves) if holder else []


def curve_holder(owner):
    """Return the holder of the keyframe curves of a piece of data; None if it has none."""
    animation = getattr(owner, "animation_data", None)
    action = animation.action if animation else None
    if action is None or hasattr(action, "fcurves"):
        return action
    return channel_bag(animation)


def channel_bag(animation):
    """Return the curves of the slot that animates this data, from Blender 5 on; None if none."""
    slot = animation.action_slot
    for layer in animation.action.layers:
        for strip in layer.strips:
            if slot and (bag := strip.channelbag(slot)):
                return bag
    return None


def remove_curves(owner, paths):
    """Delete the keyframe curves of some paths."""
    holder = curve_holder(owner)
    for curve in list(holder.fcurves) if holder else []:
        if curve.data_path in paths:
            holder.fcurves.remove(curve)


@dataclass
class LitItem:
    """An object or world that emits, and the places where its light can be set.

    reason: why it cannot be in a light group; "" if it can.
    """

    item: object
    places: list = field(default_factory=list)
    reason: str = ""

    @property
    def name(self):
        """Name of the object or world."""
        return self.item.name

    @property
    def shared(self):
        """Names of the data that hold its light: what two emitters share changes in both."""
        return {(place.owner.bl_rna.identifier, place.owner.name) for place in self.places}


def emitters(scene, view_layer):
    """Return all emitters that a render of a view layer has, in the order of their names."""
    trees = {}
    found = [emitter_of(item, trees) for item in view_layer.objects if is_rendered(item)]
    if scene.world is not None:
        found.append(world_emitter(scene.world))
    return sorted((x for x in found if x is not None), key=lambda x: x.name.casefold())


def is_rendered(item):
    """Return whether a render has an object."""
    collections = item.users_collection
    return not item.hide_render and not (
        collections and all(collection.hide_render for collection in collections)
    )


def emitter_of(item, trees):
    """Return an object's light; None for one that has none.

    trees: emission by name of material, for those that were looked at before.
    """
    if item.type == "LIGHT":
        return _checked(LitItem(item, [LampEmission(item.data)]))
    places, hidden = [], []
    for slot in item.material_slots:
        if (material := slot.material) is not None and has_nodes(material):
            if material.name_full not in trees:
                trees[material.name_full] = tree_emission(material)
            its_places, its_hidden = trees[material.name_full]
            known = {place.owner for place in places}
            places += its_places if material not in known else []
            hidden += its_hidden
    if hidden:
        return LitItem(item, [], f"its emission is inside the node group {hidden[0]}")
    return _checked(LitItem(item, places)) if places else None


def world_emitter(world):
    """Return a world's light; None for a black one."""
    if not has_nodes(world):
        is_lit = any(world.color) or PlainColour.slot in recall(world).get("slots", ())
        places, hidden = [PlainColour(world)] * is_lit, []
    else:
        places, hidden = tree_emission(world)
    if hidden:
        return LitItem(world, [], f"its light is inside the node group {hidden[0]}")
    return _checked(LitItem(world, places)) if places else None


def has_nodes(owner):
    """Return whether nodes decide what emits; from Blender 5 on they do wherever there are any."""
    # Blender 5 warns of everybody who asks.
    return owner.node_tree is not None and (_nodes_always(owner) or owner.use_nodes)


def _nodes_always(owner):
    prop = owner.bl_rna.properties.get("use_nodes")
    return prop is None or getattr(prop, "is_deprecated", False)


def tree_emission(owner):
    """Return the emitting nodes of a material or world, and names of node groups that hide some.

    Only nodes that reach the output count, and of these only those that are not black, or that
    are black since lightpaint has turned them off.
    """
    places, hidden, known = [], [], recall(owner).get("slots", ())
    for node in reaching_nodes(owner.node_tree):
        if node.type == "GROUP":
            if node.node_tree and _group_emits(node.node_tree, {owner.node_tree}):
                hidden.append(node.node_tree.name)
        elif node.type in EMITTING_NODES and (node.name in known or not is_dark(node)):
            places.append(NodeEmission(owner, node))
    return places, hidden


def reaching_nodes(tree):
    """Return the nodes whose result reaches an output that Cycles uses."""
    outputs = ("OUTPUT_MATERIAL", "OUTPUT_WORLD", "GROUP_OUTPUT")
    waiting = [
        node
        for node in tree.nodes
        if node.type in outputs and getattr(node, "target", "ALL") in ("ALL", "CYCLES")
    ]
    reached = []
    while waiting:
        node = waiting.pop()
        if node in reached or node.mute:
            continue
        reached.append(node)
        waiting += [link.from_node for socket in node.inputs for link in socket.links]
    # Their order shall be the order of the tree, whatever was connected first.
    return [node for node in tree.nodes if node in reached]


def is_dark(node):
    """Return whether a node that can emit does not, as most Principled shaders."""
    names, strength_name = EMITTING_NODES[node.type]
    colour = next((node.inputs[name] for name in names if name in node.inputs), None)
    strength = node.inputs.get(strength_name)
    if colour is None:
        return True
    if strength is not None and not strength.is_linked and strength.default_value == 0:
        return True
    return not colour.is_linked and not any(list(colour.default_value)[:3])


def _group_emits(tree, seen):
    """Return whether a node group has something in it that emits, however deep."""
    if tree in seen:
        return False
    seen.add(tree)
    return any(
        (node.type in EMITTING_NODES and not is_dark(node))
        or (node.type == "GROUP" and node.node_tree and _group_emits(node.node_tree, seen))
        for node in tree.nodes
    )


def _checked(emitter):
    """Return an emitter with the reason why it cannot be changed, if there is one."""
    item = emitter.item
    if item.library is not None or any(place.owner.library is not None for place in emitter.places):
        emitter.reason = "it is linked from another file"
        return emitter
    for place in emitter.places:
        owner, paths = place.animated_target()
        ours = set(recall(place.owner).get(KEYED, ()))
        if (others := animated_paths(owner) & set(paths) - ours) and others:
            emitter.reason = "keyframes or a driver decide its light"
        elif is_off(place):
            emitter.reason = "it gives no light: its energy or strength is zero"
        elif min(place.values()) < 0:
            emitter.reason = "its energy, strength or colour is negative"
    return emitter


def is_off(place):
    """Return whether a light is off as its owner has it, not because a painting turned it off."""
    stored = recall(place.owner).get("slots", {}).get(place.slot)
    level, *colour = stored["base"] if stored else place.values()
    return level == 0 or not any(colour)
