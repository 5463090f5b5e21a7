"""One-term mutants of a module with joint types: each changes one sign, operand, factor or name."""

import ast
import copy

from ..support.examples import examples

FIELDS, SWAPPED = examples(__file__, "fields", "swapped")

"""Names of bodies, twists and axes, and what is taken instead."""
"""The same of attributes."""
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add}
CHANGED = ast.BinOp | ast.UnaryOp | ast.Name | ast.Attribute | ast.Constant | ast.Call | ast.Tuple


def mutants(source):
    """Yield the place with the change, and the source of every mutant."""
    methods = [
        (f"{owner.name}.{each.name}", each)
        for owner in ast.parse(source).body
        if isinstance(owner, ast.ClassDef)
        for each in owner.body
        if isinstance(each, ast.FunctionDef)
    ]
    for name, function in methods:
        every = [
            node
            for statement in function.body
            for node in ast.walk(statement)
            if isinstance(node, CHANGED)
        ]
        for number, node in enumerate(every):
            for what, change in enumerate(_changes(node)):
                if ast.dump(change) == ast.dump(node):
                    continue
                other = copy.deepcopy(function)
                twin = [
                    each
                    for statement in other.body
                    for each in ast.walk(statement)
                    if isinstance(each, CHANGED)
                ][number]
                new = [*_changes(twin)][what]
                text = ast.unparse(_Replacing(twin, new).visit(other))
                where = f"{name} {number}: {ast.unparse(node)} -> {ast.unparse(new)}"
                yield where, _with_function(source, function, text)


def _changes(node):
    """Yield what stands in the place of a node."""
    match node:
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            yield ast.BinOp(left, OPERATORS[type(op)](), right)
            yield left
            yield right
        case ast.BinOp(op=ast.MatMult()) | ast.BinOp(op=ast.Mult()):
            yield ast.BinOp(ast.Constant(1.001), ast.Mult(), node)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            yield operand
        case ast.Name(id=name) if name in SWAPPED and isinstance(node.ctx, ast.Load):
            yield ast.Name(SWAPPED[name], ast.Load())
        case ast.Attribute(value=value, attr=attribute) if attribute in FIELDS:
            yield ast.Attribute(value, FIELDS[attribute], ast.Load())
        case ast.Constant(value=float(value)):
            yield ast.Constant(2.0 * value or 1.0)
        case ast.Call(func=ast.Name(id="cross"), args=[a, b]):
            yield ast.Call(ast.Name("cross", ast.Load()), [b, a], [])
        case ast.Call(func=ast.Name(id="Row"), args=args):
            for k in range(len(args)):
                zero = ast.Name("ZERO", ast.Load())
                yield ast.Call(node.func, [*args[:k], zero, *args[k + 1 :]], [])
        case ast.Tuple(elts=elements) if isinstance(node.ctx, ast.Load) and len(elements) > 1:
            yield ast.Tuple(elements[1:], ast.Load())
        case _:
            return


class _Replacing(ast.NodeTransformer):
    def __init__(self, node, new):
        self.node, self.new = node, new

    def visit(self, node):
        return self.new if node is self.node else super().generic_visit(node)


def _with_function(source, function, text):
    """Return the source with the body of a function replaced."""
    lines = source.splitlines()
    first = min([function.lineno, *(each.lineno for each in function.decorator_list)]) - 1
    indented = [" " * function.col_offset + line for line in text.splitlines()]
    return "\n".join([*lines[:first], *indented, *lines[function.end_lineno :]]) + "\n"
