"""Shows that eppy reads the view factors of a zone, and meshio what rows of a matrix stand for
and what temperatures they have.

Usage: python3 matrices.py HEMICUBE FOLDER, where HEMICUBE is the program.
"""

import csv
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
from eppy.modeleditor import IDF

# The object as the Input Data Dictionary of EnergyPlus has it; `dictionary` adds its triples.
IDD = """!IDD_Version 24.1.0
\\group Thermal Zones and Surfaces
ZoneProperty:UserViewFactors:BySurfaceName,
       \\extensible:3
  A1,  \\field Zone or ZoneList or Space or SpaceList Name
       \\type object-list
"""

TRIPLE = """  A{0},  \\field From Surface {2}
  A{1},  \\field To Surface {2}
  N{2}{3}  \\field View Factor {2}
       \\type real
       \\maximum 1.0
"""


def dictionary(pairs):
    text = IDD
    for k in range(1, pairs + 1):
        end = ";" if k == pairs else ","
        text += TRIPLE.format(2 * k, 2 * k + 1, k, end)
    return text


def run(program, folder, *args, command="factors"):
    out = subprocess.DEVNULL
    subprocess.run([program, command, *args, "-q"], cwd=folder, check=True, stdout=out)


def table(path):
    with open(path, newline="") as file:
        return list(csv.reader(file))


def check_zone(program, folder):
    made = ["furnace", "--patch-size", "0.05", "--group", "--enclosure"]
    run(program, folder, *made, "-o", "zone.idf", "--zone", "ZONE 1")
    run(program, folder, *made, "-o", "zone.csv")
    (_, *names), *rows = table(folder / "zone.csv")
    (folder / "zone.idd").write_text(dictionary(len(names) ** 2))
    IDF.setiddname(str(folder / "zone.idd"))
    idf = IDF(str(folder / "zone.idf"))
    (zone,) = idf.idfobjects["ZONEPROPERTY:USERVIEWFACTORS:BYSURFACENAME"]
    assert zone.Zone_or_ZoneList_or_Space_or_SpaceList_Name == "ZONE 1"
    fields = zone.obj[2:]
    assert len(fields) == 3 * len(names) ** 2
    found = {(f, t): float(v) for f, t, v in zip(fields[::3], fields[1::3], fields[2::3])}
    for k in range(1, len(found) + 1):
        zone.checkrange(f"View_Factor_{k}")
    for from_, *row in rows:
        assert abs(sum(found[from_, to] for to in names) - 1) < 1e-8
        for to, value in zip(names, row):
            assert found[from_, to] == float(value), (from_, to)
    print(f"zone.idf: {len(found)} view factors of {len(names)} surfaces")


def check_drawing(program, folder):
    files = ["-o", "F.npy", "--surfaces", "rows.vtu", "--surfaces", "rows.csv"]
    rows = ["--row", "ceiling", "--row", "7"]
    run(program, folder, "furnace", "--patch-size", "0.05", *rows, *files)
    mesh = meshio.read(folder / "rows.vtu")
    factors = np.load(folder / "F.npy")
    (cells,) = mesh.cells
    assert cells.type == "triangle" and len(cells.data) == len(factors)
    data = {name: blocks[0] for name, blocks in mesh.cell_data.items()}
    header, *lines = table(folder / "rows.csv")
    columns = dict(zip(header, zip(*lines)))
    named = {"area": "area", "row_sum": "front", "back": "back", "environment": "environment"}
    for name, column in named.items():
        assert np.array_equal(data[name], np.array(columns[column], float)), name
    surfaces = {int(index[0]): name for name, index in mesh.field_data.items()}
    assert [surfaces[i] for i in data["surface"]] == list(columns["name"])
    assert np.array_equal(data["F from 7"], factors[7])
    ceiling = np.array(columns["name"]) == "ceiling"
    assert np.allclose(data["F from ceiling"], factors[ceiling].mean(axis=0), atol=1e-9)
    a, b, c = (mesh.points[cells.data[:, k]] for k in range(3))
    assert np.allclose(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2, data["area"])
    middle = np.array([columns[x] for x in ("cx", "cy", "cz")], float).T
    assert np.allclose((a + b + c) / 3, middle)
    print(f"rows.vtu: {len(factors)} cells with {', '.join(data)}")


def check_heat(program, folder):
    given = ["--emissivity", ".8", "--temperature", "ceiling=400", "--temperature", "floor=300"]
    files = ["-o", "heat.vtu", "--surfaces", "surfaces.csv"]
    made = ["furnace", "--patch-size", "0.05", *given]
    run(program, folder, *made, *files, command="heat")
    run(program, folder, *made, "-o", "heat.csv", command="heat")
    mesh = meshio.read(folder / "heat.vtu")
    (cells,) = mesh.cells
    data = {name: blocks[0] for name, blocks in mesh.cell_data.items()}
    header, *lines = table(folder / "heat.csv")
    columns = dict(zip(header, zip(*lines)))
    temperature = np.array(columns["temperature_K"], float)
    assert len(temperature) == len(cells.data)
    assert np.allclose(data["temperature"], temperature, rtol=1e-11)
    assert np.allclose(data["net_flux"], np.array(columns["net_flux_W_m2"], float), atol=1e-6)
    # Walls lie between what they see, and all that the ceiling gives the floor takes.
    assert temperature.min() == 300 and temperature.max() == 400
    net = data["net_flux"] * np.array(columns["area_m2"], float)
    assert abs(net.sum()) < 1e-9 * abs(net).sum()
    print(f"heat.vtu: {len(temperature)} cells with {', '.join(data)}")


if __name__ == "__main__":
    program, folder = sys.argv[1], Path(sys.argv[2])
    check_zone(program, folder)
    check_drawing(program, folder)
    check_heat(program, folder)
