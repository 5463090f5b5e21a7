"""Models of OpenSim as texts."""


def tagged(tag, text, name=""):
    return f"<{tag}{f' name={chr(34)}{name}{chr(34)}' if name else ''}>{text}</{tag}>"


def texts(**values):
    """Elements with numbers or words as texts."""
    return "".join(tagged(key, _text(value)) for key, value in values.items())


def _text(value):
    return value if isinstance(value, str) else " ".join(map(repr, value))


def frame(name, body, at=(0.0, 0.0, 0.0), turn=(0.0, 0.0, 0.0)):
    """A frame in a body; none is the ground."""
    path = f"/bodyset/{body}" if body else "/ground"
    return tagged(
        "PhysicalOffsetFrame", texts(socket_parent=path, translation=at, orientation=turn), name
    )


def coordinate(name, value=0.0, inside=""):
    return tagged("Coordinate", f"<default_value>{value!r}</default_value>{inside}", name)


def joint(kind, name, parent, child, coordinates="", p=(), c=(), inside=""):
    """A joint between frames of two bodies, by translation and orientation of each."""
    frames = frame("on_parent", parent, *p) + frame("on_child", child, *c)
    sockets = texts(socket_parent_frame="on_parent", socket_child_frame="on_child")
    return tagged(
        kind,
        f"{sockets}<coordinates>{coordinates}</coordinates><frames>{frames}</frames>{inside}",
        name,
    )


def axis(name, along, function="", of=""):
    """An axis of a custom joint."""
    return tagged("TransformAxis", texts(coordinates=of, axis=along) + function, name)


def line(*numbers):
    return tagged("LinearFunction", texts(coefficients=numbers))


def model(bodies, joints, constraints="", forces="", more=""):
    """A document; bodies are names, or texts of elements."""
    inside = "".join(x if x.startswith("<") else f'<Body name="{x}"/>' for x in bodies)
    sets = {"Body": inside, "Joint": "".join(joints), "Constraint": constraints, "Force": forces}
    parts = "".join(
        tagged(f"{kind}Set", tagged("objects", text), f"{kind.lower()}set")
        for kind, text in sets.items()
    )
    return (
        '<OpenSimDocument Version="40000"><Model name="m"><Ground name="ground"/>'
        f"{parts}{more}</Model></OpenSimDocument>"
    )


FOUR_BAR = model(
    "abc",
    [
        joint("PinJoint", "A", "", "a", coordinate("A")),
        joint("PinJoint", "B", "a", "b", coordinate("B"), p=[(0, 2, 0)]),
        joint("PinJoint", "D", "", "c", coordinate("D"), p=[(4, 0, 0)]),
    ],
    """<PointConstraint name="C"><socket_body_1>/bodyset/b</socket_body_1>
    <socket_body_2>/bodyset/c</socket_body_2><location_body_1>4 0 0</location_body_1>
    <location_body_2>0 2 0</location_body_2></PointConstraint>""",
)
"""A parallelogram of 2 and 4, closed at a point."""
