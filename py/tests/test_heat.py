"""Heat against known values."""

import numpy as np
import pytest
import shapes

import hemicube as hc

SIGMA = 5.670374419e-8


def test_concentric_spheres_exchange_what_textbooks_say():
    vertices, faces, which = shapes.joined(
        shapes.sphere(0.5, 10), shapes.sphere(1.0, 10, inwards=True)
    )
    S = hc.view_factors(vertices, faces).lump(np.array(["inner", "outer"])[which])
    q = S.heat([500.0, 300.0], emissivity=[0.6, 0.3])
    inner, outer = S.area
    resistance = 1 / (inner * 0.6) + (1 - 0.3) / (outer * 0.3)
    assert q.power[0] == pytest.approx(SIGMA * (500**4 - 300**4) / resistance, rel=1e-3)
    assert q.power.sum() == pytest.approx(0, abs=1e-9)
    assert np.asarray(q) == pytest.approx(q.flux) and q[0] == q.flux[0] and len(q) == 2
    assert q.imbalance < 1e-9


def test_equal_temperatures_exchange_nothing():
    F = hc.view_factors(*shapes.room())
    assert not np.any(F.heat(400.0, emissivity=0.7).flux)


def test_adiabatic_walls_take_the_temperature_between():
    F = hc.view_factors(*shapes.room())
    T = np.full(12, np.nan)
    T[:2], T[2:4] = 400.0, 300.0
    q = F.heat(T, emissivity=0.8)
    assert q.flux[4:] == pytest.approx(np.zeros(8), abs=1e-9)
    assert (q.temperature[4:] > 300).all() and (q.temperature[4:] < 400).all()
    assert q.supplied == pytest.approx(q.removed) and q.power[:2].sum() == pytest.approx(q.supplied)


def test_a_supply_of_heat_settles_against_the_environment():
    F = hc.view_factors(shapes.square(), shapes.SQUARE)
    q = F.heat(flux=100.0, emissivity=0.5, environment=250.0)
    assert q.temperature == pytest.approx((100 / (0.5 * SIGMA) + 250**4) ** 0.25)
    assert q.to_environment == pytest.approx(100.0)


def test_a_sheet_in_the_sun():
    F = hc.view_factors(shapes.square(), shapes.SQUARE, sides="two")
    sun = F.sunlight([0, 0, 2], 1361.0)
    assert sun == pytest.approx([1361.0, 1361.0, 0, 0])
    q = F.heat(emissivity=0.8, absorptance=0.6, sunlight=sun, environment=0.0)
    # It radiates from both sides: 2 eps sigma T^4 = alpha S.
    assert q.temperature == pytest.approx((0.6 * 1361 / (2 * 0.8 * SIGMA)) ** 0.25)
    # Lumped, the same.
    S = F.lump(["sheet", "sheet"])
    assert S.sunlight([0, 0, 2], 1361.0) == pytest.approx([1361.0, 0])
    again = S.heat(emissivity=0.8, absorptance=0.6, sunlight=[1361.0, 0], environment=0.0)
    assert again.temperature == pytest.approx(q.temperature[:2])


def test_shade_is_dark():
    vertices = np.vstack([shapes.square(), shapes.square(0.5)])
    F = hc.view_factors(vertices, np.vstack([shapes.SQUARE, shapes.SQUARE + 4]))
    assert F.sunlight([0, 0, 1], 1000.0) == pytest.approx([0, 0, 1000, 1000])


def test_gebhart_factors_account_for_all():
    F = hc.view_factors(*shapes.room())
    emissivity = np.linspace(0.2, 0.9, 12)
    B = F.gebhart(emissivity)
    assert B.shape == (12, 12) and B.sum(axis=1) == pytest.approx(np.ones(12), abs=1e-6)
    conductors = (F.area * emissivity)[:, None] * B
    assert conductors == pytest.approx(conductors.T, rel=1e-9)
    # What each face gives is what these conductors carry.
    T = np.linspace(300, 400, 12)
    powers = (conductors * SIGMA * (T[:, None] ** 4 - T**4)).sum(axis=1)
    assert powers == pytest.approx(F.heat(T, emissivity=emissivity).power, rel=1e-6)
    assert hc.view_factors(*shapes.facing()).gebhart(1.0).sum(axis=1).max() < 0.3


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"emissivity": 1.5}, r"emissivity\[0\]: 1.5 is not from 0 to 1"),
        ({"emissivity": [0.5, 0.5]}, r"emissivity: has shape \(2,\); it should be \(4,\)"),
        ({"emissivity": np.nan}, r"emissivity\[0\]: nan"),
        ({"temperature": [300, -1, 300, 300]}, r"temperature\[1\]: -1.0 .* 20 °C are 293.15"),
        ({"temperature": np.inf}, r"temperature\[0\]: inf"),
        ({"environment": -5}, "environment=-5"),
        ({"environment": None}, "give it as environment="),
        ({"flux": 5}, "surface 0 has a temperature and a flux"),
        ({"temperature": np.nan, "flux": np.inf}, r"flux\[0\]"),
        ({"temperature": np.nan, "flux": -1e9}, "is low enough; give a larger flux="),
        ({"sunlight": -1}, r"sunlight\[0\]"),
        ({"diffuse_sunlight": -1}, "diffuse_sunlight=-1"),
        ({"absorptance": 3}, r"absorptance\[0\]"),
    ],
)
def test_what_makes_no_sense_is_said(given, message):
    F = hc.view_factors(*shapes.facing())
    usual = {"temperature": 300.0, "emissivity": 0.5, "environment": 280.0}
    with pytest.raises(hc.InputError, match=message):
        F.heat(**{**usual, **given})


def test_both_sides_of_a_face_have_one_temperature():
    F = hc.view_factors(shapes.square(), shapes.SQUARE, sides="two")
    with pytest.raises(hc.InputError, match="its other side has another one"):
        F.heat([300, 300, 310, 300], emissivity=0.5, environment=280.0)
    by_face = F.heat(flux=[40.0, 40.0], emissivity=0.5, environment=280.0)
    by_side = F.heat(flux=[40.0, 40.0, 0.0, 0.0], emissivity=0.5, environment=280.0)
    assert by_face.temperature == pytest.approx(by_side.temperature)
    assert by_face.to_environment == pytest.approx(40.0)
