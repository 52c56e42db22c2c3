# SPDX-License-Identifier: Apache-2.0
"""Robot descriptions: a link of a URDF or SDF stands on what is lowest of it, or says why not."""

import numpy as np
import pytest

from limit_surface_ros.errors import FileError
from limit_surface_ros.files.body_file import GRAVITY, read_body
from limit_surface_ros.surface.contact import pressure, shapes
from limit_surface_ros.surface.contact.patch import ContactPatch
from limit_surface_ros.surface.sampling import random_directions

INERTIAL = "<inertial><origin xyz='{0}'/><mass value='0.4'/></inertial>"
AT_THE_ORIGIN = INERTIAL.format("0 0 0")


def urdf(*shapes_, inertial=AT_THE_ORIGIN, name="base", more=""):
    """A robot of one link, with collisions of (geometry, xyz, rpy)."""
    collisions = "".join(
        f"<collision><origin xyz='{xyz}' rpy='{rpy}'/><geometry>{geometry}</geometry></collision>"
        for geometry, xyz, rpy in shapes_
    )
    return f"<robot name='r'><link name='{name}'>{inertial}{collisions}</link>{more}</robot>"


def read(tmp_path, text, suffix=".urdf", **options):
    path = tmp_path / f"robot{suffix}"
    path.write_text(text)
    return read_body(path, **{"friction_coefficient": 0.5, **options})


def loads(surface, twists):
    return surface.wrench_of_twist(twists)


def same_friction(model, cells, of=pressure.uniform, tolerance=1e-3):
    """Whether a model resists as a patch of these cells does, about the same point."""
    force = 0.4 * GRAVITY
    patch = ContactPatch.of_shape(cells, of)
    exact = patch.surface(0.5, force, model.reference_point)
    twists = random_directions(50, 0) * exact.scaling.twist_unit
    difference = np.abs(loads(model.surface, twists) - loads(exact, twists))
    return (difference / exact.scaling.wrench_unit).max() < tolerance


def test_a_box_stands_on_its_lower_face(tmp_path):
    model = read(tmp_path, urdf(("<box size='0.12 0.07 0.05'/>", "0.005 0.004 0.1", "0 0 0.3")))
    assert (model.name, model.frame_id, model.symmetry) == ("base", "base", ())
    assert model.normal_force == pytest.approx(0.4 * GRAVITY)
    np.testing.assert_allclose(model.reference_point, [0.005, 0.004], atol=1e-12)
    off_the_middle = pressure.linear([0.0, 0.0])
    cells = shapes.rectangle([0.12, 0.07]).placed([0.005, 0.004], 0.3)
    assert same_friction(model, cells, off_the_middle)


def test_a_box_on_its_side_stands_on_that_side(tmp_path):
    lying = urdf(("<box size='0.12 0.07 0.05'/>", "0 0 0", "1.5707963267948966 0 0"))
    model = read(tmp_path, lying)
    assert model.symmetry == ("x", "y")
    assert same_friction(model, shapes.rectangle([0.12, 0.05]))


def test_a_cylinder_stands_on_its_end_or_lies_on_a_line(tmp_path):
    can = "<cylinder radius='0.03' length='0.1'/>"
    assert same_friction(read(tmp_path, urdf((can, "0 0 0", "0 0 0"))), shapes.disc(0.03))
    model = read(tmp_path, urdf((can, "0 0 0", "0 1.5707963267948966 0")))
    np.testing.assert_allclose(np.sort(model.surface.points[:, 0]), [-0.05, 0.05], atol=1e-9)


def test_spheres_are_feet_whose_loads_are_statics(tmp_path):
    ball = "<sphere radius='0.01'/>"
    feet = [(ball, f"{x} {y} 0", "0 0 0") for x, y in ((0.1, 0), (-0.1, 0.1), (-0.1, -0.1))]
    raised = (ball, "0 0 0.05", "0 0 0")
    model = read(tmp_path, urdf(*feet, raised))
    assert model.of_points
    assert model.load_method == "statics"
    np.testing.assert_allclose(
        model.surface.friction_limits / (0.5 * 0.4 * GRAVITY), [0.5, 0.25, 0.25], atol=1e-9
    )


def test_an_sdf_states_its_friction(tmp_path):
    text = """<sdf version='1.9'><model name='m'><link name='l'>
      <inertial><mass>0.4</mass></inertial>
      <collision name='c'><geometry><box><size>0.12 0.07 0.05</size></box></geometry>
      <surface><friction><ode><mu>0.5</mu></ode></friction></surface></collision>
      </link></model></sdf>"""
    model = read(tmp_path, text, ".sdf", friction_coefficient=None)
    assert same_friction(model, shapes.rectangle([0.12, 0.07]))


def test_a_urdf_states_its_friction_for_gazebo(tmp_path):
    gazebo = "<gazebo reference='base'><mu1>0.25</mu1></gazebo>"
    box = ("<box size='1 1 1'/>", "0 0 0", "0 0 0")
    model = read(tmp_path, urdf(box, more=gazebo), friction_coefficient=None)
    assert model.surface.scaling.friction_force == pytest.approx(0.1 * GRAVITY)


L_PRISM = [(0, 0), (0.1, 0), (0.1, 0.03), (0.03, 0.03), (0.03, 0.08), (0, 0.08)]
L_FACES = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]


def obj():
    corners = [f"v {x} {y} {z}" for z in (0.0, 0.02) for x, y in L_PRISM]
    below = ["f " + " ".join(str(i + 1) for i in face) for face in L_FACES]
    above = ["f " + " ".join(str(i + 7) for i in face[::-1]) for face in L_FACES]
    return "\n".join([*corners, *below, *above, "f 1//1 2//1 8//1 7//1"])


def stl(binary):
    corners = np.array([[x, y, 0.0] for x, y in L_PRISM] + [[0.0, 0.0, 0.02]])
    triangles = corners[np.array([*L_FACES, (0, 1, 6)])].astype("<f4")
    if binary:
        record = np.zeros((len(triangles), 50), dtype=np.uint8)
        record[:, 12:48] = triangles.reshape(-1, 9).view(np.uint8).reshape(-1, 36)
        return b"solid".ljust(80) + len(triangles).to_bytes(4, "little") + record.tobytes()
    lines = ["solid l"]
    for triangle in triangles:
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += ["vertex " + " ".join(map(str, corner)) for corner in triangle.tolist()]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid"]).encode()


@pytest.mark.parametrize(
    ("name", "content"), [("l.obj", obj().encode()), ("l.stl", stl(True)), ("l.STL", stl(False))]
)
def test_a_mesh_stands_on_its_triangles_below(tmp_path, name, content):
    pytest.importorskip("shapely")
    (tmp_path / "pkg" / "meshes").mkdir(parents=True)
    (tmp_path / "pkg" / "meshes" / name).write_bytes(content)
    mesh = f"<mesh filename='package://pkg/meshes/{name}' scale='2 2 1'/>"
    text = urdf((mesh, "0 0 0", "0 0 0"), inertial="")
    model = read(tmp_path, text, normal_force=0.4 * GRAVITY)
    vertices = 2.0 * np.array(L_PRISM)
    assert same_friction(model, shapes.polygon(vertices), tolerance=5e-3)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot>", "is no valid XML"),
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><robot>&a;</robot>", "declares a document type"),
        ("<a>" * 500 + "</a>" * 500, "nests elements deeper than 100"),
        ("<robot/>", "name one of its links by --link: none"),
        (urdf(("<box size='1 1 1'/>", "0 0 0", "0 0 0"), inertial=""), "states no mass: give"),
        (urdf(("<box size='1 1'/>", "0 0 0", "0 0 0")), "box size must be 3 finite numbers"),
        (urdf(("<box size='1 1 nan'/>", "0 0 0", "0 0 0")), "box size must be 3 finite numbers"),
        (urdf(("<box size='1 1 -1'/>", "0 0 0", "0 0 0")), "box size must be"),
        (urdf(("<cone/>", "0 0 0", "0 0 0")), "its shape is 'cone'"),
        (urdf(), "neither collision nor visual"),
        (urdf(("<mesh filename='a.dae'/>", "0 0 0", "0 0 0")), "a.dae: meshes are read from"),
        (urdf(("<mesh filename='a.stl'/>", "0 0 0", "0 0 0")), "a.stl: .*No such file"),
        (urdf(("<mesh filename='package://p/a.stl'/>", "0 0 0", "0 0 0")), "was not found"),
        (
            urdf(("<box size='1 1 1'/>", "0 0 0", "0 0 0"), inertial=INERTIAL.format("0.6 0 0")),
            "the body would tip over",
        ),
        (
            "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'><xacro:a/></robot>",
            "is a xacro file",
        ),
    ],
)
def test_what_is_no_body_on_the_ground_is_refused_with_its_reason(tmp_path, text, message):
    with pytest.raises(FileError, match=message):
        read(tmp_path, text)


def test_a_link_is_named_where_there_are_several(tmp_path):
    two = urdf(("<box size='1 1 1'/>", "0 0 0", "0 0 0")).replace(
        "</robot>", "<link name='arm'><inertial/></link></robot>"
    )
    assert read(tmp_path, two, link="base").name == "base"
    with pytest.raises(FileError, match=r"has no link 'leg' .*; it has: arm, base"):
        read(tmp_path, two, link="leg")
    with pytest.raises(FileError, match="by --link: arm, base"):
        read(tmp_path, two)


def test_a_body_whose_mass_is_near_its_rim_lifts_the_other_side(tmp_path):
    box = urdf(
        ("<box size='0.2 0.1 0.1'/>", "0 0 0", "0 0 0"), inertial=INERTIAL.format("0.08 0 0")
    )
    surface = read(tmp_path, box).surface
    shares = surface.friction_limits / surface.friction_limits.sum()
    np.testing.assert_allclose(shares @ surface.points, [0.08, 0.0], atol=1e-9)
    # A triangle of pressure of three times the distance to the rim, as of a spring under one edge.
    assert surface.points[shares > 0.0, 0].min() == pytest.approx(0.1 - 3 * 0.02, abs=5e-3)


def test_an_area_and_a_point_at_a_time_are_left_to_a_contact_file(tmp_path):
    both = urdf(
        ("<box size='1 1 1'/>", "0 0 0.5", "0 0 0"), ("<sphere radius='0.1'/>", "2 0 0.1", "0 0 0")
    )
    with pytest.raises(FileError, match="describe its contact in a contact file"):
        read(tmp_path, both)
