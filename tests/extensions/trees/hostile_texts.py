"""Models of robots made to harm."""

from kincheck.core.extensions.trees.tree import MOST_LINKS, MOST_MOVING

from ...support.hostile_texts import LARGEST, archives, filled

BOMB = "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(9))


def model(bodies: str, equalities: str = "") -> str:
    return f"<mujoco><worldbody>{bodies}</worldbody><equality>{equalities}</equality></mujoco>"


TEXTS: dict[str, tuple[str, str | bytes, str]] = {
    "in a model": (
        "a.xml",
        model(f'<body pos="0 0 {"9" * 10_000}"><joint/></body>'),
        "expected 3 numbers",
    ),
    "deep elements": ("a.xml", filled("<a>"), "nested more than 200 deep"),
    "deep bodies": ("a.xml", model(filled("<body>")), "nested more than 5000 deep"),
    "bodies of a model": (
        "a.xml",
        model(filled("<body><joint/></body>")),
        f"more than the {MOST_MOVING} that are read",
    ),
    "fixed bodies of a model": (
        "a.xml",
        model(filled("<body/>")),
        f"more than the {MOST_LINKS} that are read",
    ),
    "many joints": (
        "a.xml",
        model("<body><joint/></body>" * 400),
        "degrees of freedom",
    ),
    "joints of a body": (
        "a.xml",
        model(f"<body>{filled('<joint/>')}</body>"),
        f"more than the {MOST_MOVING} that are read",
    ),
    "equalities": (
        "a.xml",
        model(
            '<body name="a"><joint type="ball"/></body>',
            filled('<connect body1="a" anchor="0 0 0"/>', size=LARGEST // 20),
        ),
        "degrees of freedom",
    ),
    "equalities of one name": (
        "a.xml",
        model(
            '<body name="a"><joint/></body>', '<connect name="c" body1="a" anchor="0 0 0"/>' * 5000
        ),
        "found 'c' again",
    ),
    "attributes": (
        "a.xml",
        "<mujoco " + " ".join(f'a{k}=""' for k in range(100_000)) + "/>",
        "has no body with a joint",
    ),
    "similar long names": (
        "a.xml",
        model(
            f'<body name="{"abcdefgh" * 100_000}"><joint/></body>',
            f'<connect body1="{"abcdefgi" * 100_000}" anchor="0 0 0"/>',
        ),
        "expected a body",
    ),
    "empty model": ("a.xml", "", "no element found"),
    "document type": ("a.xml", "<!DOCTYPE mujoco>" + model(""), "<!DOCTYPE>"),
    "entities": (
        "a.xml",
        f'<!DOCTYPE m [<!ENTITY a0 "ha">{BOMB}]><mujoco>&a9;</mujoco>',
        "<!DOCTYPE>",
    ),
    "entity of a file": (
        "a.xml",
        '<!DOCTYPE m [<!ENTITY a SYSTEM "file:///etc/passwd">]><mujoco>&a;</mujoco>',
        "<!DOCTYPE>",
    ),
    "unknown entity": ("a.xml", "<mujoco>&a;</mujoco>", "undefined entity"),
    "unknown encoding": (
        "a.xml",
        '<?xml version="1.0" encoding="foo"?>' + model(""),
        "no body with a joint",
    ),
    "wide encoding": (
        "a.xml",
        '<?xml version="1.0" encoding="utf-7"?>' + model(""),
        "no body with a joint",
    ),
    "include": ("a.xml", '<mujoco><include file="/etc/passwd"/></mujoco>', "no other is opened"),
    "a name that a terminal obeys": (
        "\x1b[2J\n.xml",
        model("<body><joint/></body>"),
        "control characters",
    ),
    **archives(".xml"),
}
