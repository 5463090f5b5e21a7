"""Models of robots that take too long to read are refused before they are read."""

import pytest
from kincheck.core.algebra import Vec3
from kincheck.core.case.models.files import load
from kincheck.core.extensions.trees import tree
from kincheck.core.extensions.trees.reader import read_tree
from kincheck.core.extensions.xml import element
from kincheck.core.extensions.xml.element import DEEPEST, parse_xml

from ...support.case_texts import complains, refused, write
from ...support.model_files import driven


def test_xml_elements_up_to_limit(tmp_path, monkeypatch):
    """The first one beyond it is named; there is one on each line."""
    monkeypatch.setattr(element, "MOST_ELEMENTS", most := 100)
    text = "<a>\n" + "<b/>\n" * most + "</a>"
    file = tmp_path / "model.xml"
    refused(lambda: parse_xml(file, text), f"line {most + 1}: <b>: found more than")
    fewer = text.replace("<b/>\n", "", 1)
    assert len(parse_xml(file, fewer).children) == most - 1


BODIES = """<mujoco><worldbody><body name="a"><joint name="j"/></body><body name="b"><joint/></body>
</worldbody>"""


LINKS = """<robot name="r"><link name="a"/><link name="b"/>
<joint name="j" type="continuous"><parent link="a"/><child link="b"/></joint>"""


TIES = {
    "equalities.xml": (
        BODIES + "<equality>\n{}</equality></mujoco>",
        '<connect body1="a" body2="b" anchor="0 0 0"/>\n',
    ),
    "constraints.urdf": (
        LINKS + "\n{}</robot>",
        '<constraint type="ball"><parent link="a"/><child link="b"/></constraint>\n',
    ),
}


@pytest.mark.parametrize("name", TIES)
def test_closures_up_to_limit(name, tmp_path, monkeypatch):
    monkeypatch.setattr(tree, "MOST_TIES", most := 60)
    text, tie = TIES[name]
    file = write(tmp_path, text.format(tie * (most + 1)), name)
    complains(file, f"line {most + 3}:  ... found more than", driven("j:0:1"))


def test_long_chain_of_fixed_links(tmp_path):
    base = LINKS.replace('"b"', '"l-1"')
    chain = "".join(
        f'<link name="l{k}"/><joint name="f{k}" type="fixed"><parent link="l{k - 1}"/>'
        f'<child link="l{k}"/></joint>'
        for k in range(2 * DEEPEST)
    )
    file = write(tmp_path, f"{base}{chain}</robot>", "chain.urdf")
    case = load(file, driven("j:0:1"))
    assert case.mechanism.point(f"l{2 * DEEPEST - 1}").body == "l-1"


def test_deeply_nested_mjcf_bodies(tmp_path):
    """Deeper than Python recurses."""
    deep = '<body pos="1 0 0"><frame><joint axis="0 0 1"/>'
    file = tmp_path / "deep.xml"
    file.write_text(
        f"<mujoco><include file='more.xml'/><worldbody>{deep * 1200}<site name='tip'/>"
        f"{'</frame></body>' * 1200}</worldbody></mujoco>"
    )
    (tmp_path / "more.xml").write_text("<mujocoinclude><option/></mujocoinclude>")
    found = read_tree(file, ["option"])
    assert len(found.moves) == 1200
    assert found.sites["tip"][1].at == Vec3(1200.0, 0.0, 0.0)


def test_many_linkages_of_few_digits(tmp_path):
    """Rows that are redundant but for digits are those of each linkage alone."""
    bars = "".join(
        f'<body name="c{k}" pos="{k} 0 0"><joint name="j{k}" axis="0 1 0"/><body name="r{k}"'
        f' pos="0 0 0.3"><joint axis="0.000001 1 0"/></body></body><body name="f{k}"'
        f' pos="{k + 0.4} 0 0"><joint axis="0 1 0.000001"/></body>'
        for k in range(52)
    )
    ties = "".join(
        f'<connect body1="r{k}" body2="f{k}" anchor="0.312345 0 0.212345"/>' for k in range(52)
    )
    file = tmp_path / "scene.xml"
    file.write_text(f"<mujoco><worldbody>{bars}</worldbody><equality>{ties}</equality></mujoco>")
    hold = tuple(f"j{k}" for k in range(1, 52))
    case = load(file, driven("j0:0:0.1:2", hold=hold))
    assert len(case.mechanism.drivers) == 52
    assert len(case.mechanism.reduced) == 52


def test_spring_tendon_without_length_left_out(tmp_path):
    """A tendon between sites in one place has no direction."""
    text = BODIES.replace("<joint/>", '<joint/><site name="t"/>').replace(
        '<joint name="j"/>', '<joint name="j"/><site name="s"/>'
    )
    spring = '<tendon><spatial stiffness="1"><site site="s"/><site site="t"/></spatial></tendon>'
    file = tmp_path / "model.xml"
    file.write_text(f"{text}{spring}</mujoco>")
    case = load(file, driven("j:0:1", hold_rest=True))
    assert "tendon: spatial (1)" in case.source
