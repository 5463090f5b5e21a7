"""Stages of USD as texts."""


def stage(*prims, units='metersPerUnit = 1\n    upAxis = "Z"', layer=""):
    """A stage of prims."""
    inside = "\n".join(prims)
    return f'#usda 1.0\n(\n    {units}\n    {layer}\n)\ndef Xform "r"\n{{\n{inside}\n}}\n'


def prim(kind, name, apis="", lines=(), metadata=""):
    """A prim with schemas, by their names without PhysicsXAPI around, and lines."""
    applied = ", ".join(f'"{api if "API" in api else f"Physics{api}API"}"' for api in apis.split())
    schemas = f"prepend apiSchemas = [{applied}]\n" * bool(applied) + metadata
    inside = "\n".join(lines)
    return f'def {kind} "{name}" (\n{schemas}\n)\n{{\n{inside}\n}}'


def body(name, at=(0, 0, 0), *lines, apis="RigidBody", ops=""):
    """A body at a place, with further operations behind its translation."""
    order = "".join(f', "{op.split()[1]}"' for op in ops.splitlines() if op)
    return prim(
        "Xform",
        name,
        apis,
        [
            f"double3 xformOp:translate = {tuple(at)}",
            ops,
            f'uniform token[] xformOpOrder = ["xformOp:translate"{order}]',
            *lines,
        ],
    )


def joint(kind, name, first, second, p=(0, 0, 0), q=(0, 0, 0), *lines, axis="Y", apis=""):
    """A joint between two bodies of the stage; none for the world."""
    ends = [f"rel physics:body{k} = </r/{each}>" for k, each in enumerate((first, second)) if each]
    given = [f"point3f physics:localPos{k} = {tuple(at)}" for k, at in enumerate((p, q)) if at]
    along = [f'uniform token physics:axis = "{axis}"'] if axis else []
    limited = {each.split(":")[1] for each in lines if each.startswith("float limit:")}
    apis += "".join(f" PhysicsLimitAPI:{each}" for each in sorted(limited))
    return prim(f"Physics{kind}Joint", name, apis, [*ends, *given, *along, *lines])


EXCLUDED = "bool physics:excludeFromArticulation = true"
FOUR_BAR = (
    body("a"),
    body("b", (0, 0, 2)),
    body("c", (4, 0, 0)),
    joint("Revolute", "A", "", "a"),
    joint("Revolute", "B", "a", "b", (0, 0, 2)),
    joint("Revolute", "C", "b", "c", (4, 0, 0), (0, 0, 2), EXCLUDED),
    joint("Revolute", "D", "", "c", (4, 0, 0)),
)
"""A parallelogram of 2 and 4, whose last joint closes the loop."""


def locked(axes):
    """Lines that lock axes of a generic joint."""
    return [
        line
        for axis in axes.split()
        for line in (
            f"float limit:{axis}:physics:low = 1",
            f"float limit:{axis}:physics:high = -1",
        )
    ]


def written(folder, *prims, name="m.usda", **more):
    """Write a stage into a folder, and return its file."""
    file = folder / name
    file.write_text(stage(*prims, **more))
    return file


ARM = (body("a"), body("b"), joint("Revolute", "j", "", "a"))
"""A body on a hinge, and a free one."""
