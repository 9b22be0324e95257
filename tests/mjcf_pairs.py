"""Attributes of MJCF that change MuJoCo's equations, in a machine on which each acts, and pairs with flags."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping

_TEXT = """<mujoco model="pairs"><compiler angle="degree"/>
  <option gravity="0.5 -1 -9" density="90" viscosity="0.5"><flag contact="disable"/></option>
  <worldbody>
    <body name="u" gravcomp="0.3">
      <joint name="a" axis="0 1 0.2" stiffness="2" damping="0.3" springref="20"/>
      <geom name="k" type="box" size="0.1 0.05 0.07" pos="0.1 0 0"/><site name="p" pos="0.1 0.2 0"/>
      <body name="l" pos="0.5 0 0" gravcomp="0.4"><joint name="c" type="slide" axis="1 0 0.3" damping="1" range="-1 1"/>
        <inertial mass="2" pos="0.1 0.02 0.03" diaginertia="0.1 0.12 0.14"/>
        <body name="w" pos="0 0.4 0" gravcomp="0.7"><joint name="d" type="ball"/><geom size="0.1" pos="0.05 0.1 0"/>
        </body></body></body>
    <body name="f" pos="1 1 1" gravcomp="0.2"><joint name="free" type="free"/><geom size="0.1" pos="0.1 0 0"/>
      <site name="e" pos="0.3 0.1 0"/></body>
  </worldbody>
  <tendon><fixed name="t" stiffness="1"><joint joint="a" coef="1"/><joint joint="c" coef="-2"/></fixed>
    <spatial name="r" stiffness="20"><site site="p"/><site site="e"/></spatial></tendon>
  <actuator><motor name="m" joint="a" ctrlrange="-0.4 0.3" damping="0.2" armature="0.1"/></actuator>
</mujoco>"""

#: Elements of the machine: the key in the table of attributes, and the path there; of actuators the element that takes
#: the place of the motor.
ELEMENTS: Mapping[str, tuple[str, str]] = {
    "body": ("body", ".//body[@name='l']"),
    "hinge": ("body/joint", ".//joint[@name='a']"),
    "slide": ("body/joint", ".//joint[@name='c']"),
    "ball": ("body/joint", ".//joint[@name='d']"),
    "free": ("body/joint", ".//joint[@name='free']"),
    "geom": ("body/geom", ".//geom[@name='k']"),
    "inertial": ("body/inertial", ".//inertial"),
    "fixed": ("tendon/fixed", ".//fixed"),
    "spatial": ("tendon/spatial", ".//spatial"),
    "option": ("option", "option"),
    "motor": ("actuator/motor", '<motor joint="a" gear="2"/>'),
    "tendon motor": ("actuator/motor", '<motor tendon="r"/>'),
    "general": ("actuator/general", '<general joint="c" biastype="affine" gainprm="2" biasprm="0.1 -1 -0.2"/>'),
    "activation": ("actuator/general", '<general joint="c" dyntype="filter" dynprm="0.2" gainprm="3"/>'),
    "position": ("actuator/position", '<position joint="a" kp="7"/>'),
    "velocity": ("actuator/velocity", '<velocity joint="c" kv="5"/>'),
    "intvelocity": ("actuator/intvelocity", '<intvelocity joint="a" kp="20" actrange="-0.5 0.5"/>'),
    "damper": ("actuator/damper", '<damper joint="a" kv="4" ctrlrange="0 1"/>'),
    "cylinder": ("actuator/cylinder", '<cylinder joint="c" timeconst="0.3" area="0.1"/>'),
    "muscle": ("actuator/muscle", '<muscle tendon="r" lengthrange="0.4 1.2" force="50"/>'),
    "pid": ("actuator/pid", '<pid joint="a" kp="3" kv="0.4" ki="2"/>'),
    "dcmotor": (
        "actuator/dcmotor",
        '<dcmotor joint="c" motorconst="0.3" resistance="2" input="pos vel" controller="5 2 0.3"/>',
    ),
    "orientation": ("actuator/orientation", '<orientation joint="d" kp="3"/>'),
}
#: By element: attributes with a value, separated by bars; after a semicolon other attributes that one needs.
CHANGES: Mapping[str, str] = {
    "body": (
        "gravcomp=1.3 | pos=0.4 0.1 0 | euler=10 20 30 | quat=1 0.2 0 0 | axisangle=0 1 1 30 | zaxis=0 1 2"
        " | xyaxes=0 1 0 -1 0 0"
    ),
    "hinge": (
        "damping=0.2 0.3 0.1 | stiffness=3 2 1 | springref=40 | ref=25 | armature=0.4 | pos=0.1 0.2 0"
        " | axis=1 0.3 0 | actuatorfrcrange=-0.1 0.2 | actuatorfrcrange=0.1 0.2 | springdamper=0.3 0.5"
        " | actuatorfrclimited=false; actuatorfrcrange=-0.1 0.2"
        " | actuatorgravcomp=true; actuatorfrcrange=-0.2 0.3 | type=slide"
    ),
    "slide": (
        "damping=0.2 0.3 0.1 | stiffness=3 2 1; springref=0.2 | ref=0.3 | armature=0.4"
        " | actuatorgravcomp=true; actuatorfrcrange=-0.2 0.3 | frictionloss=0.3 | range=-0.1 0.1"
    ),
    "ball": "damping=0.7 | stiffness=4 | pos=0.1 0.2 0",
    "free": "damping=0.7 | stiffness=4 | armature=0.3",
    "geom": (
        "mass=3 | density=500 | size=0.2 0.1 0.05 | pos=0.2 0.1 0 | type=ellipsoid | fluidshape=ellipsoid"
        " | fluidcoef=0.4 0.3 1.2 0.9 1.1; fluidshape=ellipsoid | euler=10 20 30 | quat=1 0.3 0 0"
        " | zaxis=0 1 2 | axisangle=0 1 1 30 | xyaxes=0 1 0 -1 0 0"
        " | fromto=0 0 0 0.3 0 0.1; type=capsule; pos= | shellinertia=true"
    ),
    "inertial": (
        "mass=3 | pos=0.2 0 0 | diaginertia=0.2 0.2 0.1 | euler=10 20 30 | quat=1 0.2 0 0"
        " | axisangle=0 1 1 30 | zaxis=0 1 2 | xyaxes=0 1 0 -1 0 0"
    ),
    "fixed": "stiffness=3 2 | damping=2 1 | springlength=-0.3 0.2",
    "spatial": "stiffness=30 4 | damping=2 1 | springlength=0.5 0.6",
    "option": "gravity=1 2 3 | density=0 | viscosity=0 | wind=1 -2 0.5 | actuatorgroupdisable=0",
    "motor": (
        "ctrlrange=-0.1 0.2 | forcerange=-0.2 0.1 | gear=3 | damping=0.2 0.3 | armature=0.4"
        " | ctrllimited=false; ctrlrange=-0.1 0.2 | forcelimited=false; forcerange=-0.2 0.1 | joint=c"
        " | jointinparent=d; joint=; gear=1 2 3 0 0 0 | site=p; joint=; gear=1 2 3 0.1 0.2 0.3"
        " | refsite=e; site=p; joint=; gear=1 2 3 0.1 0.2 0.3 | tendon=t; joint="
        " | cranksite=p; slidersite=e; cranklength=0.5; joint="
    ),
    "tendon motor": "gear=3 | damping=0.3 0.1 | ctrlrange=-0.1 0.2",
    "general": (
        "ctrlrange=-0.1 0.2 | gainprm=3 | biasprm=0.4 -2 -1 | gaintype=affine; gainprm=1 2 3 | armature=0.3"
        " | biastype=none | forcerange=-0.2 0.1 | gear=2 | damping=0.3"
    ),
    "activation": "dynprm=0.4 | dyntype=integrator | dyntype=muscle; dynprm=0.01 0.04 0.1 | ctrlrange=-0.1 0.2",
    "position": (
        "kp=20 | kv=3 | dampratio=1.2 | timeconst=0.1 | ctrlrange=-0.1 0.2 | forcerange=-1 1 | gear=2"
        " | damping=0.3 | armature=0.2 | inheritrange=0.5; joint=c"
    ),
    "velocity": "kv=2 | ctrlrange=-0.1 0.2 | forcerange=-0.1 0.1 | gear=3",
    "intvelocity": "kp=3 | kv=0.5 | dampratio=0.7 | ctrlrange=-0.1 0.2 | forcerange=-1 1",
    "damper": "kv=2 | ctrlrange=0 0.3 | gear=2 | forcerange=-0.2 0.1",
    "cylinder": "timeconst=0.2 | area=0.3 | diameter=0.4 | bias=1 2 3 | gear=2 | ctrlrange=-0.1 0.2",
    "muscle": (
        "force=20 | scale=300; force=-1 | range=0.6 1.2 | lmin=0.3 | lmax=1.9 | vmax=3 | fpmax=2 | fvmax=1.6"
        " | fvmax=1 | timeconst=0.02 0.05 | tausmooth=0.3 | lengthrange=0.3 3 | gear=2 | ctrlrange=0 0.2"
        " | forcerange=-20 0"
    ),
    "pid": (
        "kp=2 | kv=1 | ki=0.5 | imax=0.2 | slewmax=2 | input=vel; kp=; ki= | gear=2 | forcerange=-1 1"
        " | joint=d; gear=1 0 2 | dampratio=0.7; kv="
        " | ffrange=-0.1 0.1; input=pos vel ff | velrange=-0.1 0.1; input=pos vel ff"
        " | posrange=-0.1 0.1; input=pos vel ff"
    ),
    "dcmotor": (
        "motorconst=0.5; controller=; input=voltage | resistance=3; controller=; input=voltage | gear=2"
        " | inductance=0.1 | thermal=2 3 0 0.004 25 20 | cogging=0.1 7 0.3 | lugre=100 2 0.3 0.5 0.1"
        " | saturation=0.2 0 5 | controller=5 2 0.3 4 0.2 3 | input=voltage; controller="
        " | nominal=12 2 300; motorconst=; resistance=; controller=; input=voltage"
    ),
    "orientation": "kp=5 | kv=0.4 | forcerange=0 1 | input=quat | dampratio=0.8 | ctrlrange=-0.2 0.2",
}
#: Settings of flags, one or several at once.
FLAGS: Mapping[str, Mapping[str, str]] = {
    **{
        flag: {flag: "disable"}
        for flag in ("actuation", "clampctrl", "constraint", "damper", "equality", "frictionloss", "gravity", "limit")
    },
    "spring": {"spring": "disable"},
    "spring and damper": {"spring": "disable", "damper": "disable"},
    "gravity and actuation": {"gravity": "disable", "actuation": "disable"},
    "solver": dict.fromkeys(
        ("eulerdamp", "filterparent", "island", "midphase", "nativeccd", "refsafe", "sensor", "warmstart"), "disable"
    ),
    "options": dict.fromkeys(("energy", "fwdinv", "invdiscrete", "override"), "enable"),
}


def changes() -> list[tuple[str, str]]:
    """Return all changes, as element and text."""
    return [(element, text) for element, texts in CHANGES.items() for text in texts.split(" | ")]


def machine(*made: tuple[str, str], flags: Mapping[str, str] | None = None, elements: tuple[str, ...] = ()) -> str:
    """Return the machine with changes and flags, and with the actuators of ``elements``."""
    root = ET.fromstring(_TEXT)
    section = root.find("actuator")
    assert section is not None
    placed = {}
    for name in dict.fromkeys([*elements, *(element for element, _ in made)]):
        _, path = ELEMENTS[name]
        if path.startswith("<"):
            section.append(placed.setdefault(name, ET.fromstring(path)))
        else:
            found = root.find(path)
            assert found is not None
            placed[name] = found
    for name, text in made:
        for part in text.split("; "):
            attribute, _, value = part.partition("=")
            placed[name].attrib.pop(attribute, None)
            if value:
                placed[name].set(attribute, value)
    switches = root.find("option/flag")
    assert switches is not None
    for flag, value in (flags or {}).items():
        switches.set(flag, value)
    return ET.tostring(root, encoding="unicode")


def flagged() -> Iterator[tuple[str, str, str]]:
    """Yield all pairs of a change and flags, as element, text and name of the flags."""
    for element, text in changes():
        for flag in FLAGS:
            yield element, text, flag
