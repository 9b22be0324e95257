"""How each attribute of MJCF is taken: a table over MuJoCo's grammar, by element.

Elements have the keys of ``key_of_path``. An attribute without a status is one of a newer MuJoCo.
"""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.scene.sources.draft import Place
from eomgen.scene.sources.mjcf.draft import Draft

READ, IDLE, NOTED, REFUSED = "read", "without effect", "noted", "refused"
#: Meaning of each status.
MEANINGS: Mapping[str, str] = {
    READ: "takes part in the equations, the names or the start, by MuJoCo's compiler or by eomgen",
    IDLE: "pictures, contact, memory, the numbers of MuJoCo's solvers, or data of the user: no part of the equations",
    NOTED: "left out with a note if it would act; refused with `--strict`",
    REFUSED: "refused with line and name if it would act",
}


def key_of_path(path: str) -> str:
    """Return the key of an element from its tags: bodies, frames and replicates within one another count once."""
    tags = [tag for tag in path.split("/") if tag not in ("worldbody", "body", "frame", "replicate")]
    last = path.rpartition("/")[2]
    if path.startswith(("worldbody", "body")):
        if not tags:
            return "body" if last == "worldbody" else last
        return "/".join(["body", *tags])
    if tags and tags[0] == "default":
        tags = ["default", *(tag for tag in tags if tag != "default")]
    return "/".join(tags)


#: Keys of elements that have the same attributes, and these by status.
_ROWS: tuple[tuple[str, Mapping[str, str]], ...] = (
    (
        "actuator/adhesion",
        {
            READ: "class name",
            IDLE: "group user",
            REFUSED: "body ctrlrange delay forcelimited forcerange gain interp nsample",
        },
    ),
    (
        "actuator/cylinder",
        {
            READ: (
                "area armature bias class ctrllimited ctrlrange damping diameter forcelimited forcerange gear "
                "joint name site tendon timeconst"
            ),
            IDLE: "group interp lengthrange nsample user",
            REFUSED: "cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    (
        "actuator/damper",
        {
            READ: "armature class ctrlrange damping forcelimited forcerange gear joint kv name site tendon",
            IDLE: "group interp lengthrange nsample user",
            REFUSED: "cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    (
        "actuator/dcmotor",
        {
            READ: "class name",
            IDLE: "group lengthrange user",
            REFUSED: (
                "armature cogging controller cranklength cranksite ctrllimited ctrlrange damping delay gear "
                "inductance input interp joint jointinparent lugre motorconst nominal nsample refsite resistance "
                "saturation site slidersite tendon thermal"
            ),
        },
    ),
    (
        "actuator/general",
        {
            READ: (
                "actdim actlimited actrange armature biasprm biastype class ctrllimited ctrlrange damping dynprm "
                "dyntype forcelimited forcerange gainprm gaintype gear inheritrange joint name site tendon"
            ),
            IDLE: "ffrange group input interp lengthrange nsample user velrange",
            NOTED: "actearly",
            REFUSED: "body cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    (
        "actuator/intvelocity",
        {
            READ: (
                "actlimited actrange armature class ctrllimited ctrlrange damping dampratio forcelimited "
                "forcerange gear inheritrange joint kp kv name site tendon"
            ),
            IDLE: "group interp lengthrange nsample user",
            REFUSED: "cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    (
        "actuator/motor",
        {
            READ: ("armature class ctrllimited ctrlrange damping forcelimited forcerange gear joint name site tendon"),
            IDLE: "group interp lengthrange nsample user",
            REFUSED: "cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    (
        "actuator/muscle",
        {
            READ: (
                "armature class ctrllimited ctrlrange damping force forcelimited forcerange fpmax fvmax gear joint "
                "lengthrange lmax lmin name range scale tausmooth tendon timeconst vmax"
            ),
            IDLE: "group interp nsample user",
            REFUSED: "cranklength cranksite delay jointinparent slidersite",
        },
    ),
    (
        "actuator/orientation",
        {
            READ: "class name",
            IDLE: "group user",
            REFUSED: (
                "ctrlrange dampratio delay forcelimited forcerange input interp joint kp kv nsample refsite site"
            ),
        },
    ),
    (
        "actuator/pid",
        {
            READ: "class name",
            IDLE: "group lengthrange user",
            REFUSED: (
                "armature cranklength cranksite ctrllimited ctrlrange damping dampratio delay ffrange "
                "forcelimited forcerange gear imax inheritrange input interp joint jointinparent ki kp kv "
                "nsample posrange refsite site slewmax slidersite tendon velrange"
            ),
        },
    ),
    (
        "actuator/plugin",
        {
            IDLE: "group user",
            REFUSED: (
                "actdim actearly actlimited actrange armature class cranklength cranksite ctrllimited ctrlrange "
                "damping delay dynprm dyntype forcelimited forcerange gear instance interp joint jointinparent "
                "lengthrange name nsample plugin site slidersite tendon"
            ),
        },
    ),
    (
        (
            "actuator/plugin/config asset/mesh/plugin/config body/flexcomp/plugin/config "
            "body/geom/plugin/config body/plugin/config extension/plugin/instance/config"
        ),
        {REFUSED: "key value"},
    ),
    (
        "actuator/position",
        {
            READ: (
                "armature class ctrllimited ctrlrange damping dampratio forcelimited forcerange gear "
                "inheritrange joint kp kv name site tendon timeconst"
            ),
            IDLE: "group interp lengthrange nsample user",
            REFUSED: "cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    (
        "actuator/velocity",
        {
            READ: (
                "armature class ctrllimited ctrlrange damping forcelimited forcerange gear joint kv name site tendon"
            ),
            IDLE: "group interp lengthrange nsample user",
            REFUSED: "cranklength cranksite delay jointinparent refsite slidersite",
        },
    ),
    ("asset/hfield", {IDLE: "content_type elevation file name ncol nrow size"}),
    (
        "asset/material",
        {
            IDLE: (
                "class emission metallic name reflectance rgba roughness shininess specular texrepeat texture "
                "texuniform"
            )
        },
    ),
    ("asset/material/layer default/material/layer", {IDLE: "role texture"}),
    (
        "asset/mesh",
        {
            READ: "builtin class content_type face file inertia name params refpos refquat scale vertex",
            IDLE: "material maxhullvert normal smoothnormal texcoord",
        },
    ),
    ("asset/mesh/plugin body/flexcomp/plugin body/geom/plugin body/plugin", {REFUSED: "instance plugin"}),
    ("asset/model", {READ: "content_type file name"}),
    ("asset/skin deformable/skin", {IDLE: "face file group inflate material name rgba texcoord vertex"}),
    ("asset/skin/bone deformable/skin/bone", {IDLE: "bindpos bindquat body vertid vertweight"}),
    (
        "asset/texture",
        {
            IDLE: (
                "builtin class colorspace content_type embed file fileback filedown filefront fileleft fileright "
                "fileup gridlayout gridsize height hflip mark markrgb name nchannel random rgb1 rgb2 type vflip "
                "width"
            )
        },
    ),
    (
        "body",
        {
            READ: "axisangle childclass euler gravcomp name pos quat xyaxes zaxis",
            IDLE: "fuse simple sleep user",
            NOTED: "mocap",
        },
    ),
    ("body/attach", {READ: "body frame model prefix"}),
    (
        "body/camera",
        {
            IDLE: (
                "axisangle class euler focal focalpixel fovy ipd mode name output pos principal principalpixel "
                "projection quat resolution sensorsize target user xyaxes zaxis"
            )
        },
    ),
    (
        "body/flexcomp",
        {
            IDLE: "group material rgba",
            REFUSED: (
                "axisangle cellcount count dim dof element euler file flatskin inertiabox mass mesh name origin "
                "point pos quat radius rigid scale spacing texcoord type xyaxes zaxis"
            ),
        },
    ),
    (
        "body/flexcomp/contact deformable/flex/contact",
        {
            REFUSED: (
                "activelayers conaffinity condim contype friction gap margin passive priority selfcollide solimp "
                "solmix solref"
            )
        },
    ),
    ("body/flexcomp/edge", {REFUSED: "damping equality solimp solref stiffness"}),
    (
        "body/flexcomp/elasticity deformable/flex/elasticity",
        {REFUSED: "damping elastic2d poisson section sectionsize shear thickness yield young"},
    ),
    ("body/flexcomp/pin", {REFUSED: "grid gridrange id range"}),
    ("body/freejoint", {READ: "align name", IDLE: "group"}),
    (
        "body/geom",
        {
            READ: (
                "axisangle class density euler fitscale fromto hfield mass mesh name pos quat shellinertia size "
                "type xyaxes zaxis"
            ),
            IDLE: "castshadow group material rgba user",
            NOTED: ("adhesion conaffinity condim contype friction gap margin priority solimp solmix solref surfacevel"),
            REFUSED: "fluidcoef fluidshape",
        },
    ),
    ("body/inertial", {READ: "axisangle diaginertia euler fullinertia mass pos quat xyaxes zaxis"}),
    (
        "body/joint",
        {
            READ: (
                "actuatorfrclimited actuatorfrcrange actuatorgravcomp armature axis class damping name pos ref "
                "springdamper springref stiffness type"
            ),
            IDLE: "group margin solimpfriction solreffriction user",
            NOTED: "frictionloss limited range solimplimit solreflimit",
            REFUSED: "springyield",
        },
    ),
    (
        "body/light",
        {
            IDLE: (
                "active ambient attenuation bulbradius castshadow class cutoff diffuse dir directional exponent "
                "intensity mode name pos range softness specular target texture type"
            )
        },
    ),
    (
        "body/site",
        {
            READ: "axisangle class euler fromto name pos quat xyaxes zaxis",
            IDLE: "group material mesh rgba size type user",
        },
    ),
    (
        "compiler",
        {
            READ: (
                "alignfree angle assetdir autolimits balanceinertia boundinertia boundmass coordinate eulerseq "
                "fitaabb fusestatic inertiafromgeom inertiagrouprange meshdir settotalmass"
            ),
            IDLE: (
                "conflict discardvisual passthrough savecanonical savecompiled saveinertial strippath texturedir "
                "usethread"
            ),
        },
    ),
    (
        "compiler/lengthrange",
        {IDLE: "accel interval inttotal maxforce mode timeconst timestep tolrange useexisting uselimit"},
    ),
    ("contact/exclude", {NOTED: "body1 body2 name"}),
    (
        "contact/pair",
        {NOTED: "adhesion class condim friction gap geom1 geom2 margin name solimp solref solreffriction"},
    ),
    ("custom/numeric", {IDLE: "data name size"}),
    ("custom/text", {IDLE: "data name"}),
    ("custom/tuple", {IDLE: "name"}),
    ("custom/tuple/element", {IDLE: "objname objtype prm"}),
    ("default", {READ: "class"}),
    ("default/adhesion", {IDLE: "group user", REFUSED: "ctrlrange delay forcelimited forcerange gain interp nsample"}),
    (
        "default/camera",
        {
            IDLE: (
                "axisangle euler focal focalpixel fovy ipd mode output pos principal principalpixel projection "
                "quat resolution sensorsize user xyaxes zaxis"
            )
        },
    ),
    (
        "default/cylinder",
        {
            READ: ("area armature bias ctrllimited ctrlrange damping diameter forcelimited forcerange gear timeconst"),
            IDLE: "group interp nsample user",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "default/damper",
        {
            READ: "armature ctrlrange damping forcelimited forcerange gear kv",
            IDLE: "group interp nsample user",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "default/dcmotor",
        {
            IDLE: "group user",
            REFUSED: (
                "armature cogging controller cranklength ctrllimited ctrlrange damping delay gear inductance "
                "input interp lugre motorconst nominal nsample resistance saturation thermal"
            ),
        },
    ),
    ("default/equality", {READ: "active", IDLE: "solimp solref"}),
    (
        "default/general",
        {
            READ: (
                "actdim actlimited actrange armature biasprm biastype ctrllimited ctrlrange damping dynprm "
                "dyntype forcelimited forcerange gainprm gaintype gear inheritrange"
            ),
            IDLE: "ffrange group input interp nsample user velrange",
            NOTED: "actearly",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "default/geom",
        {
            READ: (
                "axisangle density euler fitscale fromto hfield mass mesh pos quat shellinertia size type xyaxes zaxis"
            ),
            IDLE: "castshadow group material rgba user",
            NOTED: ("adhesion conaffinity condim contype friction gap margin priority solimp solmix solref surfacevel"),
            REFUSED: "fluidcoef fluidshape",
        },
    ),
    (
        "default/intvelocity",
        {
            READ: (
                "actlimited actrange armature ctrllimited ctrlrange damping dampratio forcelimited forcerange "
                "gear inheritrange kp kv"
            ),
            IDLE: "group interp nsample user",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "default/joint",
        {
            READ: (
                "actuatorfrclimited actuatorfrcrange actuatorgravcomp armature axis damping pos ref springdamper "
                "springref stiffness type"
            ),
            IDLE: "group margin solimpfriction solreffriction user",
            NOTED: "frictionloss limited range solimplimit solreflimit",
            REFUSED: "springyield",
        },
    ),
    (
        "default/light",
        {
            IDLE: (
                "active ambient attenuation bulbradius castshadow cutoff diffuse dir directional exponent "
                "intensity mode pos range softness specular type"
            )
        },
    ),
    (
        "default/material",
        {IDLE: ("emission metallic reflectance rgba roughness shininess specular texrepeat texture texuniform")},
    ),
    ("default/mesh", {READ: "inertia scale", IDLE: "maxhullvert"}),
    (
        "default/motor",
        {
            READ: "armature ctrllimited ctrlrange damping forcelimited forcerange gear",
            IDLE: "group interp nsample user",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "default/muscle",
        {
            IDLE: "group user",
            REFUSED: (
                "armature cranklength ctrllimited ctrlrange damping delay force forcelimited forcerange fpmax "
                "fvmax gear interp lmax lmin nsample range scale timeconst vmax"
            ),
        },
    ),
    (
        "default/orientation",
        {IDLE: "group user", REFUSED: "ctrlrange dampratio delay forcelimited forcerange input interp kp kv nsample"},
    ),
    ("default/pair", {NOTED: "adhesion condim friction gap margin solimp solref solreffriction"}),
    (
        "default/pid",
        {
            IDLE: "group user",
            REFUSED: (
                "armature cranklength ctrllimited ctrlrange damping dampratio delay ffrange forcelimited "
                "forcerange gear imax inheritrange input interp ki kp kv nsample posrange slewmax velrange"
            ),
        },
    ),
    (
        "default/position",
        {
            READ: (
                "armature ctrllimited ctrlrange damping dampratio forcelimited forcerange gear inheritrange kp "
                "kv timeconst"
            ),
            IDLE: "group interp nsample user",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "default/site",
        {READ: "axisangle euler fromto pos quat xyaxes zaxis", IDLE: "group material mesh rgba size type user"},
    ),
    (
        "default/tendon",
        {
            READ: "damping springlength stiffness",
            IDLE: ("group margin material rgba solimpfriction solimplimit solreffriction solreflimit user width"),
            NOTED: "frictionloss limited range",
            REFUSED: "actuatorfrclimited actuatorfrcrange armature springyield",
        },
    ),
    (
        "default/texture",
        {
            IDLE: (
                "builtin colorspace embed gridlayout gridsize height hflip mark markrgb nchannel random rgb1 "
                "rgb2 type vflip width"
            )
        },
    ),
    (
        "default/velocity",
        {
            READ: "armature ctrllimited ctrlrange damping forcelimited forcerange gear kv",
            IDLE: "group interp nsample user",
            REFUSED: "cranklength delay",
        },
    ),
    (
        "deformable/flex",
        {
            IDLE: "group material rgba",
            REFUSED: (
                "body cellcount dim dof element elemtexcoord flatskin name node nodecoord radius texcoord vertex"
            ),
        },
    ),
    ("deformable/flex/edge", {REFUSED: "damping stiffness"}),
    ("equality/connect", {READ: "active anchor body1 body2 class name site1 site2", IDLE: "solimp solref"}),
    ("equality/flex", {REFUSED: "active class flex name solimp solref"}),
    ("equality/flexstrain", {REFUSED: "active cell class flex name solimp solref"}),
    ("equality/joint", {READ: "active class joint1 joint2 name polycoef", IDLE: "solimp solref"}),
    ("equality/tendon", {READ: "active class name polycoef tendon1 tendon2", IDLE: "solimp solref"}),
    (
        "equality/weld",
        {READ: "active anchor body1 body2 class name relpose site1 site2", IDLE: "solimp solref torquescale"},
    ),
    ("extension/plugin", {REFUSED: "plugin"}),
    ("extension/plugin/instance", {REFUSED: "name"}),
    ("keyframe/key", {READ: "act ctrl name qpos qvel", IDLE: "mpos mquat plastic time"}),
    ("mujoco", {READ: "model"}),
    (
        "option",
        {
            READ: "actuatorgroupdisable density gravity viscosity wind",
            IDLE: (
                "ccd_iterations ccd_tolerance cone impratio integrator iterations jacobian ls_iterations "
                "ls_tolerance magnetic noslip_iterations noslip_tolerance o_friction o_margin o_solimp o_solref "
                "sdf_initpoints sdf_iterations sleep_tolerance solver timestep tolerance"
            ),
        },
    ),
    (
        "option/flag",
        {
            READ: "actuation clampctrl constraint contact damper equality frictionloss gravity limit spring",
            IDLE: (
                "autoreset diagexact energy eulerdamp filterparent fwdinv invdiscrete ipc island midphase "
                "multiccd nativeccd override refsafe sensor sleep speculative warmstart"
            ),
        },
    ),
    (
        "sensor/accelerometer sensor/gyro sensor/magnetometer sensor/velocimeter",
        {READ: "cutoff name site", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    (
        "sensor/force sensor/torque sensor/touch",
        {IDLE: "user", NOTED: "cutoff delay interp interval name noise nsample site"},
    ),
    (
        "sensor/actuatorfrc sensor/actuatorpos sensor/actuatorvel",
        {READ: "actuator cutoff name", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    (
        "sensor/ballangvel sensor/ballquat sensor/jointpos sensor/jointvel",
        {READ: "cutoff joint name", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    (
        "sensor/jointactuatorfrc sensor/jointlimitfrc sensor/jointlimitpos sensor/jointlimitvel",
        {IDLE: "user", NOTED: "cutoff delay interp interval joint name noise nsample"},
    ),
    ("sensor/camprojection", {IDLE: "user", NOTED: "camera cutoff delay interp interval name noise nsample site"}),
    (
        "sensor/clock sensor/e_kinetic",
        {READ: "cutoff name", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    ("sensor/e_potential", {IDLE: "user", NOTED: "cutoff delay interp interval name noise nsample"}),
    (
        "sensor/contact",
        {
            IDLE: "user",
            NOTED: (
                "body1 body2 cutoff data delay geom1 geom2 interp interval name noise nsample num reduce site "
                "subtree1 subtree2"
            ),
        },
    ),
    (
        "sensor/distance sensor/fromto sensor/normal",
        {IDLE: "user", NOTED: "body1 body2 cutoff delay geom1 geom2 interp interval name noise nsample"},
    ),
    (
        "sensor/frameangacc",
        {IDLE: "user", NOTED: "cutoff delay interp interval name noise nsample objname objtype"},
    ),
    (
        "sensor/framelinacc",
        {READ: "cutoff name objname objtype", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    (
        ("sensor/frameangvel sensor/framelinvel sensor/framepos sensor/framexaxis sensor/frameyaxis sensor/framezaxis"),
        {
            READ: "cutoff name objname objtype",
            IDLE: "interp noise nsample user",
            NOTED: "delay interval refname reftype",
        },
    ),
    (
        "sensor/framequat",
        {IDLE: "user", NOTED: "cutoff delay interp interval name noise nsample objname objtype refname reftype"},
    ),
    (
        "sensor/insidesite",
        {IDLE: "user", NOTED: "cutoff delay enclosed interp interval name noise nsample objname objtype site"},
    ),
    ("sensor/plugin", {IDLE: "user", NOTED: "cutoff instance name objname objtype plugin refname reftype"}),
    ("sensor/plugin/config", {NOTED: "key value"}),
    ("sensor/rangefinder", {IDLE: "user", NOTED: "camera cutoff data delay interp interval name noise nsample site"}),
    ("sensor/subtreeangmom", {IDLE: "user", NOTED: "body cutoff delay interp interval name noise nsample"}),
    (
        "sensor/subtreecom sensor/subtreelinvel",
        {READ: "body cutoff name", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    ("sensor/tactile", {IDLE: "user", NOTED: "cutoff delay geom interp interval mesh name nsample"}),
    (
        "sensor/tendonpos sensor/tendonvel",
        {READ: "cutoff name tendon", IDLE: "interp noise nsample user", NOTED: "delay interval"},
    ),
    (
        "sensor/tendonactuatorfrc sensor/tendonlimitfrc sensor/tendonlimitpos sensor/tendonlimitvel",
        {IDLE: "user", NOTED: "cutoff delay interp interval name noise nsample tendon"},
    ),
    ("sensor/user", {IDLE: "user", NOTED: "cutoff datatype dim name needstage noise objname objtype"}),
    (
        "size",
        {
            IDLE: (
                "memory nconmax njmax nkey nstack nuser_actuator nuser_body nuser_cam nuser_geom nuser_jnt "
                "nuser_sensor nuser_site nuser_tendon nuserdata"
            )
        },
    ),
    ("statistic", {IDLE: "center extent meaninertia meanmass meansize"}),
    (
        "tendon/fixed",
        {
            READ: "class damping name springlength stiffness",
            IDLE: "group margin solimpfriction solimplimit solreffriction solreflimit user",
            NOTED: "frictionloss limited range",
            REFUSED: "actuatorfrclimited actuatorfrcrange armature springyield",
        },
    ),
    ("tendon/fixed/joint", {READ: "coef joint"}),
    (
        "tendon/spatial",
        {
            READ: "class damping name springlength stiffness",
            IDLE: ("group margin material rgba solimpfriction solimplimit solreffriction solreflimit user width"),
            NOTED: "frictionloss limited range",
            REFUSED: "actuatorfrclimited actuatorfrcrange armature springyield",
        },
    ),
    ("tendon/spatial/geom", {READ: "geom sidesite"}),
    ("tendon/spatial/pulley", {READ: "divisor"}),
    ("tendon/spatial/site", {READ: "site"}),
    (
        "visual/global",
        {
            IDLE: (
                "azimuth bvactive cameraid elevation ellipsoidinertia fovy glow ipd linewidth offheight offwidth "
                "orthographic realtime"
            )
        },
    ),
    ("visual/headlight", {IDLE: "active ambient diffuse specular"}),
    (
        "visual/map",
        {
            IDLE: (
                "actuatortendon alpha fogend fogstart force haze shadowclip shadowscale stiffness stiffnessrot "
                "torque zfar znear"
            )
        },
    ),
    ("visual/quality", {IDLE: "numquads numslices numstacks offsamples shadowsize"}),
    (
        "visual/rgba",
        {
            IDLE: (
                "actuator actuatornegative actuatorpositive bv bvactive camera com connect constraint "
                "contactforce contactfriction contactgap contactpoint contacttorque crankbroken fog force "
                "frustum haze inertia joint light rangefinder selectpoint slidercrank"
            )
        },
    ),
    (
        "visual/scale",
        {
            IDLE: (
                "actuatorlength actuatorwidth camera com connect constraint contactheight contactwidth "
                "forcewidth framelength framewidth frustum jointlength jointwidth light selectpoint slidercrank"
            )
        },
    ),
    ("frame", {READ: "axisangle childclass euler name pos quat xyaxes zaxis"}),
    ("replicate", {READ: "count euler offset sep"}),
)
#: Status by attribute, of each element.
STATUSES: Mapping[str, Mapping[str, str]] = {
    key: {name: status for status, names in by_status.items() for name in names.split()}
    for keys, by_status in _ROWS
    for key in keys.split()
}


def note_unknown_attributes(draft: Draft) -> None:
    """Note attributes of a newer MuJoCo than the one of the table."""
    for path, element, file in draft.elements.every:
        known = STATUSES.get(key_of_path(path), {})
        for name in element.unread_attributes:
            if name not in known:
                note = f"not read: the attribute {name} of <{element.tag}>, which this version does not know"
                draft.leave_out(Place(file, element.line), note)
