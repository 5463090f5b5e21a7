"""Stages of USD as texts."""

from functools import partial

from .case_texts import write


def stage(*prims, units='metersPerUnit = 1\n    upAxis = "Z"'):
    """A stage of prims."""
    inside = "\n".join(prims)
    return f'#usda 1.0\n(\n    {units}\n)\ndef Xform "r"\n{{\n{inside}\n}}\n'


def prim(kind, name, *lines, apis="", metadata=""):
    """A prim with lines and schemas, by their names without PhysicsXAPI around."""
    applied = ", ".join(f'"{api if "API" in api else f"Physics{api}API"}"' for api in apis.split())
    schemas = f"prepend apiSchemas = [{applied}]\n" * bool(applied) + metadata
    inside = "\n".join(lines)
    return f'def {kind} "{name}" (\n{schemas}\n)\n{{\n{inside}\n}}'


def body(name, *lines, at=(0, 0, 0), apis="RigidBody", ops=""):
    """A body at a place, with further operations behind its translation."""
    order = "".join(f', "{op.split()[1]}"' for op in ops.splitlines() if op)
    place = f"double3 xformOp:translate = {tuple(map(float, at))}\n{ops}"
    order = f'uniform token[] xformOpOrder = ["xformOp:translate"{order}]'
    return prim("Xform", name, place, order, *lines, apis=apis)


heavy = partial(body, apis="RigidBody Mass")
ZERO = (0, 0, 0)


def joint(kind, name, first, second, *lines, p=ZERO, q=ZERO, axis="Y", apis=""):
    """A joint between two bodies of the stage; none for the world."""
    ends = [f"rel physics:body{k} = </r/{each}>" for k, each in enumerate((first, second)) if each]
    given = [
        f"point3f physics:localPos{k} = {tuple(map(float, at))}"
        for k, at in enumerate((p, q))
        if at is not None
    ]
    along = [f'uniform token physics:axis = "{axis}"'] if axis else []
    limited = {each.split(":")[1] for each in lines if each.startswith("float limit:")}
    apis += "".join(f" PhysicsLimitAPI:{each}" for each in sorted(limited))
    return prim(f"Physics{kind}Joint", name, *ends, *given, *along, *lines, apis=apis)


hinge = partial(joint, "Revolute")
EXCLUDED = "bool physics:excludeFromArticulation = true"


def parallelogram(width, height, axis):
    """Links and hinges, the third of which closes the loop."""
    return (
        body("a"),
        body("b", at=height),
        body("c", at=width),
        hinge("A", "", "a", axis=axis),
        hinge("B", "a", "b", p=height, axis=axis),
        hinge("C", "b", "c", EXCLUDED, p=width, q=height, axis=axis),
        hinge("D", "", "c", p=width, axis=axis),
    )


FOUR_BAR = parallelogram((4, 0, 0), (0, 0, 2), "Y")
ARM = (body("a"), body("b"), hinge("j", "", "a"))
"""A body on a hinge, and a free one."""


def locked(axes):
    """Lines that lock axes of a generic joint: low above high, or zero for both."""
    ends = {"trans": ("low = 1", "high = -1"), "rot": ("low = 0", "high = 0")}
    return [f"float limit:{x}:physics:{end}" for x in axes.split() for end in ends[x[:-1]]]


def write_stage(folder, *prims, name="m.usda", **units):
    """Write a stage into a folder, and return its file."""
    return write(folder, stage(*prims, **units), name)
