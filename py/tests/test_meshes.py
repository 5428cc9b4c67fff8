"""Meshes of other libraries and of files."""

import numpy as np
import pytest
import shapes

import hemicube as hc

BOX = shapes.room((2, 3, 2.5))


def sums(F):
    return F.matrix.sum(axis=1)


def write_obj(path, vertices, faces, names):
    lines = [f"v {x} {y} {z}" for x, y, z in vertices]
    for name, (a, b, c) in zip(names, faces + 1):
        lines += [f"g {name}", f"f {a} {b} {c}"]
    path.write_text("\n".join(lines) + "\n")


def test_trimesh_meshes_and_back():
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box((2, 3, 2.5))
    mesh.invert()
    F = hc.view_factors(mesh)
    assert sums(F) == pytest.approx(np.ones(12), abs=1e-6)
    again = F.to_trimesh()
    assert again.area == pytest.approx(mesh.area)
    assert list(again.face_attributes["row"]) == list(range(12))
    with pytest.raises(hc.InputError, match="a Scene has no triangles"):
        hc.view_factors(trimesh.Scene(mesh))


def test_pyvista_meshes_and_back():
    pyvista = pytest.importorskip("pyvista")
    vertices, faces = BOX
    mesh = pyvista.PolyData.from_regular_faces(vertices, faces)
    F = hc.view_factors(mesh)
    assert (F.matrix != hc.view_factors(*BOX).matrix).nnz == 0
    drawn = F.to_pyvista(area=F.area)
    assert drawn.n_cells == 12 and drawn.cell_data["area"] == pytest.approx(F.area)
    assert drawn.area == pytest.approx(mesh.area)
    two = hc.view_factors(mesh, sides="two")
    drawn = two.to_pyvista(row=np.arange(24))
    assert list(drawn.cell_data["row_back"]) == list(range(12, 24))
    with pytest.raises(hc.InputError, match=r"triangulate\(\) it"):
        hc.view_factors(pyvista.Box())


def test_meshio_meshes(tmp_path):
    meshio = pytest.importorskip("meshio")
    vertices, faces = BOX
    cells = [("line", faces[:2, :2]), ("triangle", faces[:5]), ("triangle", faces[5:])]
    F = hc.view_factors(meshio.Mesh(vertices, cells))
    assert (F.matrix != hc.view_factors(*BOX).matrix).nnz == 0
    with pytest.raises(hc.InputError, match="cells of the meshio mesh are quad; give triangles"):
        hc.view_factors(meshio.Mesh(vertices, [("quad", [[0, 1, 3, 2]])]))
    for name in ("box.stl", "box.ply"):
        path = tmp_path / name
        meshio.write_points_cells(path, vertices, [("triangle", faces)])
        read = hc.view_factors(hc.read(path))
        assert read.area.sum() == pytest.approx(F.area.sum(), rel=1e-6)
        assert sums(read) == pytest.approx(np.ones(12), abs=1e-5)


def test_files_have_units_and_names(tmp_path):
    vertices, faces = BOX
    path = tmp_path / "box.obj"
    names = ["floor"] * 2 + ["ceiling"] * 2 + ["wall"] * 8
    write_obj(path, 1000 * vertices, faces, names)
    mesh = hc.read(path, unit="mm")
    assert mesh.vertices == pytest.approx(vertices) and (mesh.faces == faces).all()
    assert list(mesh.surface) == names and mesh.name == "box"
    F = hc.view_factors(mesh)
    assert (F.matrix != hc.view_factors(*BOX).matrix).nnz == 0
    assert list(F.lump(mesh.surface).labels) == ["floor", "ceiling", "wall"]
    with pytest.warns(hc.ModelWarning, match=r"faces\[:, ::-1\]"):
        hc.view_factors(hc.read(path, unit="mm", flip=True))


def test_files_that_are_none_are_said(tmp_path):
    with pytest.raises(hc.FileError, match="nowhere.obj: cannot be read") as caught:
        hc.read(tmp_path / "nowhere.obj")
    assert isinstance(caught.value, OSError)
    broken = tmp_path / "broken.obj"
    broken.write_text("v 0 0 0\nf 1 2 3\n")
    with pytest.raises(hc.FileError, match="line 2"):
        hc.read(broken)
    with pytest.raises(hc.InputError, match="give one of m, mm"):
        hc.read(broken, unit="furlong")
    with pytest.raises(hc.InputError, match="unit=-1"):
        hc.read(broken, unit=-1)
