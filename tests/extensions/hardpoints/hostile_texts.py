"""Tables of hardpoints made to harm."""

from kincheck.core.extensions.hardpoints.read import MOST_POINTS

from ...support.hostile_texts import archives, filled

TEXTS: dict[str, tuple[str, str | bytes, str]] = {
    "in a table": ("a.csv", f"name,x,y,z\nwheel,1,2,{'9' * 10_000}\n", "expected a coordinate"),
    "hardpoints": (
        "a.csv",
        "name,x,y,z\n" + "\n".join(f"p{k},1,2,3" for k in range(20_000)),
        f"{MOST_POINTS} at most",
    ),
    "hardpoints of Adams": (
        "a.sub",
        "[HARDPOINT]\n" + "\n".join(f"p{k} left 1 2 3" for k in range(20_000)),
        f"{MOST_POINTS} at most",
    ),
    "a long field": ("a.csv", f"name,x,y,z\n{'a' * 1_000_000},1,2,3\n", "line 2: not valid CSV"),
    "blanks": ("a.sub", filled(" ", "[UNITS]\nLENGTH = {}a'b'c"), "no row in a block"),
    "empty table": ("a.csv", "", "is empty"),
    **archives(".csv", ".sub"),
}
