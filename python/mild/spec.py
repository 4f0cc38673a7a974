"""Soft ground under a model of one's own: MuJoCo's MjSpec and the engine plugin (docs/plugin.md)."""
import os
import pathlib

from . import _mujoco

PLUGIN, FILE = "mild.ground", "libmild_plugin.so"


MOST = 16  # feet and bodies, MILD_FEET_MAX


def attach(spec, feet=(), ground="sand_loose", *, body=(), exclude=True, surface=True, sensor=None, name="ground", library=None, **attributes):
    """Puts soft ground under the feet of a mujoco.MjSpec, before spec.compile(); returns the plugin's instance.

    feet: names of bodies or sites, z up from the sole. body: names of other bodies, such as shins, a trunk or wheels, whose
    shapes meet the ground on any side; with the feet 1 .. 16. ground: a preset, a soil's file (docs/soil.md), a
    Material, or a list of presets and files where terrain__patches is given. exclude: feet and bodies no longer touch geoms of the world body, such as a rigid floor, nor those of a
    body fixed in it that has a plane or a height field; all else touches them as before. surface: the
    ground is drawn in its own colour, dented, and planes of the floor are not seen; they are touched as before. sensor: name of a sensor to add, whose data are (feet + bodies, 12) numbers, a row for each
    foot and then for each body: force, torque, centre of pressure, area, largest and mean depth (docs/plugin.md).
    attributes: those of the plugin with __ for the dot: prints=64, ground__mu=0.5, terrain__kind="waves". library: the
    plugin's file; None: $MILD_PLUGIN, or the package's own. Raises TypeError for what is no MjSpec, ValueError for feet,
    bodies and grounds that there are not, RuntimeError without the plugin; mujoco reports attributes that are wrong when it
    compiles."""
    import mujoco

    if not isinstance(spec, mujoco.MjSpec):
        raise TypeError(f"spec: a {type(spec).__name__}, but it must be a mujoco.MjSpec")
    feet, body = names_of(feet, "feet"), names_of(body, "body")
    for foot in feet:
        if spec.body(foot) is None and spec.site(foot) is None:
            raise ValueError(f"feet: the spec has no body or site '{foot}'")
    for one in body:
        if spec.body(one) is None:
            raise ValueError(f"body: the spec has no body '{one}'")
    if not 1 <= len(feet) + len(body) <= MOST:
        raise ValueError(f"feet: {len(feet)} of them and {len(body)} in body, but there must be 1 .. {MOST}")
    names = feet + body
    bodies = [spec.body(one) or spec.site(one).parent for one in names]
    for k, one in enumerate(bodies):
        if one in bodies[:k]:
            raise ValueError(f"{'feet' if k < len(feet) else 'body'}: '{names[bodies.index(one)]}' and '{names[k]}' are on one body, "
                             f"'{one.name}', which would stand on the ground twice; name it once")
    config = {**({"feet": " ".join(feet)} if feet else {}), **({"body": " ".join(body)} if body else {}), **ground_of(ground)}
    if surface:
        config["surface"] = "1"
    config.update((key.replace("__", "."), text_of(value)) for key, value in attributes.items())
    load_plugin(library)
    spec.activate_plugin(PLUGIN)
    plugin = spec.add_plugin(plugin_name=PLUGIN, name=name)
    plugin.config = config
    if exclude:
        exclude_world(spec, names)
    if surface:
        hide_planes(spec)
    if sensor:
        listener = spec.add_sensor(name=sensor, type=mujoco.mjtSensor.mjSENS_PLUGIN).plugin
        listener.active, listener.name, listener.plugin_name = True, name, PLUGIN
    return plugin


def names_of(given, key):
    """A list of names that the plugin can read, from one name or several."""
    names = [given] if isinstance(given, str) else list(given)
    for name in names:
        if not isinstance(name, str) or any(c in name for c in " \t\r\n,"):
            raise ValueError(f"{key}: {name!r}, but it must be a name without blanks and commas; "
                             f"{'name a site instead' if key == 'feet' else 'rename the body'}")
    return names


def floors(spec):
    """Names of the bodies that are ground: the world's, and those fixed in it that have a plane or a height field."""
    import mujoco

    flat, names, bodies = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD), {spec.worldbody.name}, list(spec.worldbody.bodies)
    while bodies:
        body = bodies.pop()
        if not body.joints and not body.mocap:
            bodies += list(body.bodies)
            names |= {body.name} if body.name and any(geom.type in flat for geom in body.geoms) else set()
    return names


def planes(spec):
    """The planes of the ground, which are the world body's or those of bodies fixed in it."""
    import mujoco

    bodies = [spec.worldbody, *(spec.body(name) for name in sorted(floors(spec) - {spec.worldbody.name}))]
    return [geom for body in bodies for geom in body.geoms if geom.type == mujoco.mjtGeom.mjGEOM_PLANE]


def hide_planes(spec):
    """Planes of the ground are not drawn; uneven ground has height fields, which hide nothing."""
    for geom in planes(spec):
        geom.rgba, geom.material = [0.5, 0.5, 0.5, 0], ""


def exclude_world(spec, names):
    """Excludes the contacts of feet and bodies with the world body and other floors. A body without a name cannot be excluded."""
    bodies = {(spec.body(name) or spec.site(name).parent).name for name in names}
    known, grounds = {frozenset((pair.bodyname1, pair.bodyname2)) for pair in spec.excludes}, floors(spec)
    for body in sorted(bodies - {""} - grounds):
        for ground in sorted(grounds):
            if frozenset((body, ground)) not in known:
                spec.add_exclude(bodyname1=ground, bodyname2=body)


def load_plugin(library=None):
    """Loads the engine plugin, for models whose XML names it: `library`, else $MILD_PLUGIN, else the package's own for the
    MuJoCo that is imported. A process that has it may do so again. Raises RuntimeError when there is no such file, or when it
    is for another MuJoCo. Returns the file."""
    import mujoco

    named = library or os.environ.get("MILD_PLUGIN")
    path = pathlib.Path(named) if named else _mujoco.folder(FILE, "plugin") / FILE
    if not path.is_file():
        raise RuntimeError(f"library: there is no plugin '{path}'; `make plugin` builds it")
    try:
        mujoco.mj_loadPluginLibrary(str(path.resolve()))
    except Exception as error:
        raise RuntimeError(f"library: {path} does not go with MuJoCo {mujoco.mj_versionString()}: {error}") from None
    return path.resolve()


def ground_of(ground):
    """The plugin's attributes of a ground. The numbers of one soil's file go into the model, so that it needs the file no more."""
    from . import Material

    if isinstance(ground, (str, os.PathLike)):
        ground = os.fspath(ground)
        ground = Material(ground) if ground.endswith(".ini") else ground.replace(",", " ").split()
    if isinstance(ground, (list, tuple)) and all(isinstance(one, (str, os.PathLike)) for one in ground):
        words = [listed(os.fspath(one)) for one in ground]
        for word in words:
            Material(word)  # refuses here what the plugin would refuse when the spec is compiled
        return {"ground": " ".join(words)}

    if not isinstance(ground, Material):
        raise TypeError(f"ground: a {type(ground).__name__}, but it must be a preset, a soil's file, a Material, or a list of presets and files")
    return {"ground." + key: value for key, value in ground.as_dict().items()}


def listed(ground):
    """A ground as a word of the plugin's list: a file by its whole path."""
    if not ground.endswith(".ini"):
        return ground
    path = os.path.abspath(ground)
    if any(c in path for c in " \t\r\n,"):
        raise ValueError(f"ground: {path!r}, but in a list a file's path must be without blanks and commas; give it alone, or move it")
    return path


def text_of(value):
    return str(value).lower() if isinstance(value, bool) else str(value)
