"""View factors against known values, and what is refused."""

import pickle
import threading
import time

import numpy as np
import pytest
import shapes

import hemicube as hc


def test_opposite_squares_have_the_analytic_value():
    for distance in (0.5, 1.0, 3.0):
        F = hc.view_factors(*shapes.facing(distance), error=1e-4)
        lumped = F.lump(["floor", "floor", "ceiling", "ceiling"])
        known = shapes.parallel(1.0, distance)
        assert lumped.matrix[0, 1] == pytest.approx(known, rel=1e-5)
        assert list(lumped.labels) == ["floor", "ceiling"]
        assert F.matrix.sum(axis=1) + F.escape == pytest.approx(np.ones(4), abs=1e-3)
        assert F.area == pytest.approx([0.5] * 4) and F.error < 1e-4


def test_a_sphere_in_a_sphere():
    vertices, faces, which = shapes.joined(
        shapes.sphere(0.5, 10), shapes.sphere(1.0, 10, inwards=True)
    )
    F = hc.view_factors(vertices, faces)
    S = F.lump(which)
    inner, outer = S.area
    assert S.matrix.toarray() == pytest.approx(
        np.array([[0, 1], [inner / outer, 1 - inner / outer]]), abs=1e-3
    )
    assert not F.is_open


def test_rows_of_a_closed_box_sum_to_one():
    F = hc.view_factors(*shapes.room((3, 4, 2.5)))
    assert F.matrix.sum(axis=1) == pytest.approx(np.ones(12), abs=1e-6)
    assert F.matrix.dtype == np.float32
    closed = hc.view_factors(*shapes.room((3, 4, 2.5)), enclosure=True)
    assert closed.matrix.sum(axis=1) == pytest.approx(np.ones(12), abs=1e-12)
    assert closed.matrix.dtype == np.float64
    exchange = closed.matrix.toarray() * closed.area[:, None]
    assert exchange == pytest.approx(exchange.T, rel=1e-12)


def test_some_rows_are_those_of_the_whole():
    mesh = shapes.room()
    whole, some = hc.view_factors(*mesh), hc.view_factors(*mesh, rows=range(3, 7))
    assert some.shape == (4, 12) and len(some.area) == 12
    assert list(some.rows) == [3, 4, 5, 6]
    assert (some.matrix != whole.matrix[3:7]).nnz == 0
    assert (some.escape == whole.escape[3:7]).all()
    with pytest.raises(hc.InputError, match="these are 4 of 12"):
        some.lump(np.zeros(12, int))
    with pytest.raises(ValueError, match="no row 12"):
        hc.view_factors(*mesh, rows=[0, 12])


def test_obstacles_hide_and_have_no_rows():
    vertices, faces = shapes.facing()
    open_ = hc.view_factors(vertices, faces)
    hidden = hc.view_factors(vertices, faces, obstacles=(shapes.square(0.5), shapes.SQUARE))
    assert hidden.shape == open_.shape
    assert hidden.matrix.sum() < 1e-6 < open_.matrix.sum()
    known = shapes.parallel(1.0, 0.5)
    assert np.average(hidden.back, weights=hidden.area) == pytest.approx(known, abs=0.02)


def test_two_sides_have_two_rows():
    vertices, faces = shapes.facing()
    F = hc.view_factors(vertices, faces[:, ::-1], sides="two")
    assert F.shape == (8, 8)
    assert list(F.face) == [0, 1, 2, 3] * 2 and list(F.front) == [0, 1, 2, 3] * 2
    # The squares are turned away from each other: their backs see.
    S = F.lump(["a", "a", "b", "b"])
    assert list(S.labels) == ["a", "b", "a (back)", "b (back)"]
    assert S.matrix[2, 3] == pytest.approx(shapes.parallel(1, 1), rel=1e-4)
    assert S.matrix[0, 1] == 0


def test_faces_are_cut_where_patches_are_smaller():
    F = hc.view_factors(*shapes.facing(), patch_size=0.05)
    assert len(F) > 40 and set(F.face) == {0, 1, 2, 3}
    assert F.area.max() <= 0.05 and F.area.sum() == pytest.approx(2)
    S = F.lump([0, 0, 1, 1])
    assert S.matrix[0, 1] == pytest.approx(shapes.parallel(1, 1), rel=1e-3)


def test_a_linear_operator_does_what_the_matrix_does():
    F = hc.view_factors(*shapes.room())
    x = np.arange(12.0)
    operator = F.as_linear_operator()
    assert operator @ x == pytest.approx(F.matrix @ x)
    assert operator.T @ x == pytest.approx(F.matrix.T @ x)


def test_the_matrix_takes_over_what_the_library_filled():
    F = hc.view_factors(*shapes.room())
    assert np.shares_memory(F.matrix.data, F._values)
    assert np.shares_memory(F.matrix.indices, F._columns)
    assert F.matrix.has_sorted_indices and F.matrix is F.matrix
    before = F.matrix.toarray()
    for shared in (F.matrix.data, F.matrix.indices):
        with pytest.raises(ValueError, match="read-only"):
            shared[...] = 0
    F.matrix.copy().data[...] = 0
    assert (F.matrix.toarray() == before).all()


def test_arrays_of_any_kind_will_do():
    vertices, faces = shapes.room()
    wanted = hc.view_factors(vertices, faces).matrix
    for v, f in [
        (vertices.astype(np.float32), faces.astype(np.uint8)),
        (np.asfortranarray(vertices), np.asfortranarray(faces)),
        (vertices.tolist(), faces.tolist()),
        (vertices[::-1], 7 - faces),
        (np.frombuffer(b"." + vertices.tobytes(), offset=1).reshape(-1, 3), faces),
    ]:
        assert (hc.view_factors(v, f).matrix != wanted).nnz == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v, f: (v[:, :2], f), r"vertices: has shape \(8, 2\); it should be \(n, 3\)"),
        (lambda v, f: (v, f[:, :2]), r"faces: has shape \(12, 2\); it should be \(m, 3\)"),
        (lambda v, f: (v, f.astype(float)), "faces: has dtype float64"),
        (lambda v, f: (v.astype(complex), f), "vertices: has dtype complex128"),
        (lambda v, f: (v * [1, 1, np.nan], f), r"vertices\[0\]: \[0.0, 0.0, nan\] is not finite"),
        (lambda v, f: (v, f + 2), r"faces\[2\]: .* is no triangle of vertices, which has 8 rows"),
        (lambda v, f: (v, f - 1), r"faces\[0\]: \[-1, 0, 2\]"),
        (lambda v, f: (v, f[:0]), "there are no faces"),
        (lambda v, f: (1e30 * v, f), "vertex 1: .* exceeds 1e15 metres"),
        (lambda v, f: (v, [[0, 1, 2], [0, 1]]), "faces: is no array"),
        (lambda v, f: (np.ma.masked_array(v, v > 0), f), "vertices: is a masked array"),
        (lambda v, f: (v, None), "a ndarray has no triangles that are known here"),
    ],
)
def test_what_makes_no_sense_is_said(change, message):
    with pytest.raises(hc.InputError, match=message) as caught:
        hc.view_factors(*change(*shapes.room()))
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, hc.Error)
    assert "--" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"error": 0}, "error=0: is a share"),
        ({"error": 2}, "error=2: is a share"),
        ({"patch_size": -1}, "patch_size=-1: is not above 0"),
        ({"patch_size": 1e-12}, "patch_size="),
        ({"threshold": 1}, "threshold=1"),
        ({"sides": "three"}, "give 'one', 'two'"),
        ({"rows": []}, "rows=: give integers"),
        ({"seed": -1}, "seed=-1: is no integer"),
        ({"seed": 0.5}, "seed=0.5: is no integer"),
        ({"memory": -1}, "memory=-1"),
        ({"progress": "yes"}, "progress='yes': give True"),
        ({"rows": [-1]}, "no row -1"),
        ({"rows": 5}, "rows=5: give integers"),
        ({"error": None}, "error=None: is a share"),
        ({"memory": "4G"}, "memory='4G': is no number of bytes"),
        ({"threshold": None}, "threshold=None: is no number"),
        ({"sides": None}, "sides=None: give 'one'"),
        ({"obstacles": (np.zeros((3, 3)),)}, "obstacles=: has 1 parts"),
        ({"rows": [0], "enclosure": True}, "takes all of its rows"),
        ({"obstacles": (np.zeros((2, 3)), [[0, 1, 2]])}, r"obstacles: faces\[0\]"),
    ],
)
def test_options_that_make_no_sense_are_said(options, message):
    with pytest.raises(hc.InputError, match=message):
        hc.view_factors(*shapes.facing(), **options)


def test_an_open_model_is_no_enclosure():
    with pytest.raises(hc.InputError, match="no enclosure.*leave enclosure= out"):
        hc.view_factors(*shapes.facing(), enclosure=True)


def test_too_little_memory_is_a_memory_error():
    with pytest.raises(MemoryError, match="1 KiB are allowed, half of memory=") as caught:
        hc.view_factors(*shapes.room(), memory=2048)
    assert isinstance(caught.value, hc.OutOfMemory)


def test_bodies_seen_from_outside_are_doubted():
    vertices, faces = shapes.room()
    with pytest.warns(hc.ModelWarning, match=r"faces\[:, ::-1\]"):
        hc.view_factors(vertices, faces[:, ::-1])


def test_labels_are_checked():
    F = hc.view_factors(*shapes.room())
    with pytest.raises(hc.InputError, match=r"labels: has shape \(3,\); it should be \(12,\)"):
        F.lump([1, 2, 3])
    assert list(F.lump(np.array(["a", "b"] * 6, object)).labels) == ["a", "b"]
    for mixed in (["a", 1] * 6, np.array(["a", 1] * 6, object)):
        with pytest.raises(hc.InputError, match="give integers or strings"):
            F.lump(mixed)


def test_the_sun_is_somewhere():
    with pytest.raises(hc.InputError, match="toward: has no direction"):
        hc.view_factors(*shapes.room()).sunlight([0, 0, 0])


def test_progress_is_heard_and_may_raise():
    mesh = shapes.sphere(1.0, 14, inwards=True)
    heard = []
    hc.view_factors(*mesh, progress=lambda done, total: heard.append((done, total)))
    assert heard and all(done <= total or total == 0 for done, total in heard)

    class Enough(Exception):
        pass

    def stop(done, total):
        raise Enough

    for given in (mesh, shapes.room()):
        with pytest.raises(Enough):
            hc.view_factors(*given, progress=stop)


def test_a_bar_is_shown_on_stderr(capfd):
    hc.view_factors(*shapes.sphere(1.0, 14, inwards=True), progress=True)
    assert "form factors" in capfd.readouterr().err


def test_other_threads_go_on():
    counted = 0
    stop = threading.Event()

    def count():
        nonlocal counted
        while not stop.is_set():
            counted += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    try:
        hc.view_factors(*shapes.sphere(1.0, 14, inwards=True))
        assert counted > 10
    finally:
        stop.set()
        thread.join()


def test_factors_can_be_stored():
    F = hc.view_factors(*shapes.facing())
    assert (F.matrix.nnz, F.report["rows"]) == (8, 4)
    copy = pickle.loads(pickle.dumps(F))
    assert (copy.matrix != F.matrix).nnz == 0 and (copy.area == F.area).all()
    with pytest.raises(hc.InputError, match="not kept in a copy"):
        copy.sunlight([0, 0, 1])


def test_notebooks_show_a_table():
    text = hc.view_factors(*shapes.room()).lump(["<b>"] * 12)._repr_html_()
    assert "view factors" in text and "&lt;b&gt;" in text and "<b>" not in text
