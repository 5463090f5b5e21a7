"""SDF models; an attribute of the root says how they are driven."""

from kincheck.core.extensions.trees.robot_elements import STRUT
from kincheck.core.extensions.trees.sdf import IN_AXIS, IN_JOINT, IN_LINK, IN_MODEL, TYPES

from ....fuzz.fuzzing import changing, reading
from ....fuzz.trees import changed_xml

LONGEST = 4200
WORDS = (
    *(*IN_MODEL, *IN_LINK, *IN_JOINT, *IN_AXIS, *TYPES),
    *("relative_to", "attached_to", "expressed_in", "degrees", "rotation_format", "quat_xyzw"),
    *("world", "__model__", "canonical_link", "sdf", "version", "1.4", "1.10", "true", "xyz"),
    *("multiplier", "offset", "reference", "damping", "spring_stiffness", "spring_reference"),
    *(f"{STRUT}{each}" for each in ("", "_body_A", "_p_BQ", "_stiffness", "_free_length")),
)
FOUR_BAR = b"""<sdf version="1.9" said="drive A:0:0.5:5 hold "><model name="m"><pose degrees="true">0 0 1 0 0 30</pose>
<link name="a"><visual name="v"/></link><link name="b"><pose relative_to="B"/></link>
<link name="c"><pose>4 0 0 0 0.3 0</pose></link>
<frame name="B" attached_to="a"><pose>0 0 2 0.1 0.2 0.3</pose></frame>
<joint name="A" type="revolute"><parent>world</parent><child>a</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="B3" type="continuous"><parent>a</parent><child>B2</child><axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint>
<frame name="B2" attached_to="b"/>
<joint name="D" type="revolute"><parent>world</parent><child>c</child><axis><xyz>0 1 0</xyz></axis></joint>
<joint name="C" type="revolute"><pose relative_to="__model__">4 0 2 0 0 0</pose><parent>c</parent><child>b</child><axis><xyz expressed_in="a">0 1 0</xyz></axis></joint>
</model></sdf>"""  # noqa: E501
TYPED = b"""<sdf version="1.11" said="drive m::s:0:0.1:3 hold m::u.1 m::u.2 m::ball m::w.rotation n::base">
<world name="w"><model name="still"><static>1</static><link name="base"/></model><model name="m"><link name="a"/><link name="b"><pose>1 0 0 0 0 0</pose></link>
<link name="c"><pose rotation_format="quat_xyzw">0 1 0 0 0 0.6 0.8</pose></link><link name="d"/><link name="e"/>
<joint name="s" type="prismatic"><parent>world</parent><child>a</child><axis><dynamics><damping>1</damping><spring_stiffness>2</spring_stiffness></dynamics></axis></joint>
<joint name="u" type="universal"><parent>a</parent><child>b</child><axis/><axis2><xyz>1 0 0</xyz></axis2></joint>
<joint name="ball" type="ball"><parent>c</parent><child>a</child></joint>
<joint name="w" type="screw"><parent>a</parent><child>d</child><axis/><screw_thread_pitch>0.01</screw_thread_pitch></joint>
<joint name="m" type="revolute"><parent>d</parent><child>e</child><axis><mimic joint="s"><multiplier>2</multiplier></mimic></axis></joint>
<drake:linear_spring_damper name="x"><drake:linear_spring_damper_body_A>a</drake:linear_spring_damper_body_A>
<drake:linear_spring_damper_body_B>b</drake:linear_spring_damper_body_B><drake:linear_spring_damper_p_AP>0 1 0</drake:linear_spring_damper_p_AP>
<drake:linear_spring_damper_stiffness>7</drake:linear_spring_damper_stiffness></drake:linear_spring_damper></model><model name="n"><link name="base"/></model></world></sdf>"""  # noqa: E501


one = reading("model.sdf")


def seeds() -> list[bytes]:
    """A four-bar whose last joint closes the loop, and all types of joints in several models."""
    return [FOUR_BAR, TYPED]


mutate = changing(changed_xml, words=WORDS)
