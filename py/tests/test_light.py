"""Light of scenes."""

import struct

import numpy as np
import pytest

import hemicube as hc


@pytest.fixture(scope="module")
def furnace():
    """A closed box all of whose walls emit and reflect alike."""
    return hc.load("furnace")


@pytest.fixture(scope="module")
def box():
    return hc.load("cornell-box")


@pytest.fixture(scope="module")
def light(box):
    return box.light(error=0.05)


def test_a_furnace_is_alike_everywhere(furnace):
    light = furnace.light(samples=256)
    low, high = furnace.mesh.vertices.min(axis=0), furnace.mesh.vertices.max(axis=0)
    points = low + (high - low) * np.random.default_rng(1).uniform(0.2, 0.8, (20, 3))
    E, half = light.probe(points, [0, 1, 0])
    assert E.shape == half.shape == (20, 3)
    assert E == pytest.approx(np.broadcast_to(E[0], (20, 3)), rel=0.02)
    view = {"eye": (low + high) / 2, "target": high}
    image = light.render(**view, size=(16, 12))
    assert np.pi * image.mean() == pytest.approx(E.mean(), rel=0.02)


def test_irradiance_is_known_to_its_half_widths(box, light):
    low, high = box.mesh.vertices.min(axis=0), box.mesh.vertices.max(axis=0)
    points = low + (high - low) * np.random.default_rng(1).uniform(0.1, 0.9, (40, 3))
    E, half = light.probe(points, [0.0, 1.0, 0.0])
    free = np.isfinite(E).all(axis=1)
    better, fine = box.light(error=0.01).probe(points, [0, 1, 0], samples=1 << 15)
    off = np.abs(hc.luminance(E) - hc.luminance(better))[free]
    allowed = np.hypot(hc.luminance(half), hc.luminance(fine))[free]
    assert (off <= allowed).mean() > 0.85 and free.sum() > 20


def test_points_outside_are_nan(light):
    with pytest.warns(hc.ModelWarning, match="1 of 2 points are outside the model: they are nan"):
        E, half = light.probe([[0.2, 0.9, 0.2], [90.0, 0.0, 0.0]], [[0, 1, 0], [0, 2, 0]])
    assert np.isnan(E[1]).all() and np.isnan(half[1]).all() and np.isfinite(E[0]).all()


def test_the_length_of_a_normal_is_no_matter(light):
    wanted, _ = light.probe([[0.2, 0.3, 0.2]], [0, 1, 0])
    for length in (1e200, 1e-200):
        assert (light.probe([[0.2, 0.3, 0.2]], [0, length, 0])[0] == wanted).all()


def test_pictures_have_rows_of_pixels(light):
    image = light.render(size=(32, 24), samples=2)
    assert image.shape == (24, 32, 3) and image.dtype == np.float32
    assert image.min() >= 0 and image.max() > 10 * np.median(image[image > 0])


def test_models_are_baked_and_stored(light, tmp_path):
    assert light.bake(tmp_path / "out.glb", mode="vertex") == [str(tmp_path / "out.glb")]
    head = (tmp_path / "out.glb").read_bytes()[:12]
    magic, version, length = struct.unpack("<4sII", head)
    assert (magic, version, length) == (b"glTF", 2, (tmp_path / "out.glb").stat().st_size)
    light.save(tmp_path / "box.hemi")
    assert (tmp_path / "box.hemi").stat().st_size > 1000
    with pytest.raises(hc.InputError, match="are written as .glb"):
        light.bake(tmp_path / "out.png")
    with pytest.raises(hc.InputError, match="are written as .hemi"):
        light.save(tmp_path / "out.npz")
    with pytest.raises(hc.FileError, match="cannot write"):
        light.save(tmp_path / "no" / "folder.hemi")


def test_lamps_sky_and_materials_are_changed(tmp_path):
    floor = "v 0 0 0\nv 0 0 4\nv 4 0 4\nv 4 0 0\nusemtl floor\nf 1 2 3\nf 1 3 4\n"
    (tmp_path / "floor.obj").write_text(floor)
    with pytest.warns(hc.ModelWarning):
        scene = hc.load(tmp_path / "floor.obj")
    with pytest.raises(hc.InputError, match="nothing emits light; give it scene.sky"):
        scene.light()
    scene.sky = 10.0
    assert scene.sky == (10.0, 10.0, 10.0)
    place = ([[2.0, 0.0, 2.0]], [0, 1, 0])
    E, _ = scene.light(samples=64).probe(*place)
    assert E[0] == pytest.approx(np.pi * np.full(3, 10.0), rel=1e-3)
    scene.sky = 0.0
    scene.add_lamp([2, 2, 2], 4 * np.pi * np.array([100.0, 50.0, 0.0]))
    E, _ = scene.light(samples=64).probe(*place)
    assert E[0] == pytest.approx([25, 12.5, 0], rel=1e-3, abs=1e-6)
    scene.add_sun([0, 1, 0], 7.0)
    E, _ = scene.light(samples=64).probe(*place)
    assert E[0] == pytest.approx([32, 19.5, 7], rel=1e-3)
    names = set(scene.mesh.material)
    scene.set_reflectance(names.pop(), 0.2)
    with pytest.raises(hc.InputError, match="there is none of that name; there are"):
        scene.set_emission("gold", 1.0)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda s, l: s.light(error=3), "error=3: is a share"),
        (lambda s, l: s.light(error=0.1, samples=9), "leave one of them out"),
        (lambda s, l: s.light(patch_size=0), "patch_size=0"),
        (lambda s, l: s.light(samples=0), "samples=0"),
        (lambda s, l: l.probe([[0, 0, 0]], [0, 0, 0]), r"normals\[0\]: has no direction"),
        (lambda s, l: l.probe([[0, 0, 0]], [[0, 0, 1]] * 2), r"normals: has shape \(2, 3\)"),
        (lambda s, l: l.probe([0, 0, 0], [0, 0, 1]), r"points: has shape \(3,\)"),
        (lambda s, l: l.probe([[0, 0, 0]], [0, 0, 1], samples=5), "samples=5"),
        (lambda s, l: l.render(eye=[0, 0, 0]), "give both, or none"),
        (lambda s, l: l.render(eye=[0, 0, 0], target=[0, 0, 0]), "give another eye= or target="),
        (lambda s, l: l.render(size=(0, 5)), r"size=\(0, 5\)"),
        (lambda s, l: l.render(size=(100000, 5)), "give another size="),
        (lambda s, l: l.render(vfov=200), "vfov=200"),
        (lambda s, l: l.bake("x.glb", mode="soft"), "mode='soft'"),
        (lambda s, l: setattr(s, "sky", -1), "sky: -1.0 is negative"),
        (lambda s, l: s.light(samples=256.5), "samples=256.5: is no integer from 32"),
        (lambda s, l: s.light(samples=1 << 17), "samples=131072"),
        (lambda s, l: s.add_sun([0, 0, 0], 1.0), "toward: has no direction"),
        (lambda s, l: s.add_sun([0, 1, 0], 1e31), "irradiance: .* exceeds 1e30"),
        (lambda s, l: s.add_lamp([1e16, 0, 0], 1.0), "position: .* exceeds 1e15 metres"),
        (lambda s, l: s.add_lamp([0, 0, 0], 1e32), "flux: .* exceeds 1e30"),
        (lambda s, l: setattr(s, "sky", 1e31), "sky: .* exceeds 1e30"),
        (lambda s, l: s.set_emission("none", 1e31), "radiance: .* exceeds 1e30"),
        (lambda s, l: l.render(up=[0, 0, 0]), "up: has no direction"),
        (lambda s, l: l.bake("x.glb", exposure="a"), "exposure='a'"),
        (lambda s, l: hc.load("room", sides="xx"), "sides=\"xx\""),
        (lambda s, l: hc.load("room", unit="mm"), "unit=: is for files"),
        (lambda s, l: hc.load("room", up=[0, 0, 1]), "up=: is for files"),
        (lambda s, l: hc.load("room", max_reflectance=0.5), "max_reflectance=: is for files"),
        (lambda s, l: hc.load("no-such-scene"), "nor a built-in scene"),
    ],
)
def test_what_makes_no_sense_is_said(box, light, call, message):
    with pytest.raises(hc.InputError, match=message) as caught:
        call(box, light)
    assert "--" not in str(caught.value)
