"""Reads a .vtu file with VTK's own reader and compares it with what a JSON file says it holds, number by number.

read_vtu.py FILE.vtu EXPECTED.json    exit code 0 when all is as expected
"""
import json
import sys

from vtkmodules.vtkCommonCore import vtkStringArray
from vtkmodules.vtkFiltersCore import vtkFeatureEdges
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersVerdict import vtkCellSizeFilter
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

failures = []


def expect(condition, what):
    if not condition:
        failures.append(what)


def tuples(array):
    return [list(array.GetTuple(i)) for i in range(array.GetNumberOfTuples())]


def compare_arrays(data, expected, where):
    names = {data.GetArrayName(i) for i in range(data.GetNumberOfArrays())}
    expect(names == set(expected), f"{where} arrays {names}, not {set(expected)}")
    for name in names & set(expected):
        array, want = data.GetArray(name), expected[name]
        expect(array.GetDataTypeAsString() == want["type"], f"{where} {name} is of {array.GetDataTypeAsString()}")
        components = [array.GetComponentName(c) for c in range(array.GetNumberOfComponents())]
        if len(components) > 1:
            expect(components == want["components"], f"{where} {name} has components {components}")
        expect(tuples(array) == want["tuples"], f"{where} {name}: values differ")


def cyclic(a, b):
    return len(a) == len(b) and any(a[k:] + a[:k] == b for k in range(len(a)))


def main():
    errors = []
    reader = vtkXMLUnstructuredGridReader()
    for event in ("ErrorEvent", "WarningEvent"):
        reader.AddObserver(event, lambda caller, name: errors.append(name))
    reader.SetFileName(sys.argv[1])
    reader.Update()
    grid = reader.GetOutput()
    with open(sys.argv[2], encoding="utf-8") as file:
        expected = json.load(file)

    expect(not errors, f"the reader says {errors}")
    points = [list(grid.GetPoint(i)) for i in range(grid.GetNumberOfPoints())]
    expect(points == expected["points"], "points differ")
    expect(grid.GetPoints().GetData().GetDataTypeAsString() == "double", "points are not in double precision")
    expect(grid.GetNumberOfCells() == len(expected["cells"]), f"{grid.GetNumberOfCells()} cells")
    for i, want in enumerate(expected["cells"]):
        cell = grid.GetCell(i)
        ids = [cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())]
        expect(cell.GetClassName() == want["class"], f"cell {i} is a {cell.GetClassName()}, not a {want['class']}")
        expect(cyclic(ids, want["points"]), f"cell {i} has the points {ids}, not {want['points']}")
    compare_arrays(grid.GetPointData(), expected["point_data"], "point data")
    compare_arrays(grid.GetCellData(), expected["cell_data"], "cell data")
    scalars = grid.GetPointData().GetScalars()
    expect(scalars is not None and scalars.GetName() == "luminance", "the active scalar is not the luminance")

    fields = {}
    for i in range(grid.GetFieldData().GetNumberOfArrays()):
        array = grid.GetFieldData().GetAbstractArray(i)
        expect(isinstance(array, vtkStringArray), f"field {array.GetName()} is not of texts")
        fields[array.GetName()] = [array.GetValue(k) for k in range(array.GetNumberOfValues())]
    expect(fields.pop("generator", [""])[0].startswith("clrad "), "no generator")
    expect(fields == expected["field_data"], f"field data {fields}")

    # VTK's own areas. Coordinates below 2 with 53 bits, edges of 0.075 at least: rounding is below 1e-13 of an area.
    size = vtkCellSizeFilter()
    size.SetInputData(grid)
    size.Update()
    area = size.GetOutput().GetCellData().GetArray("Area")
    given = grid.GetCellData().GetArray("area_m2")
    for i in range(grid.GetNumberOfCells()):
        a, b = area.GetValue(i), given.GetValue(i)
        expect(abs(a - b) <= 1e-12 * b, f"cell {i} has an area of {a}, and area_m2 says {b}")

    # Cracks would show as edges that only one cell has, inside a polygon.
    surface, edges = vtkGeometryFilter(), vtkFeatureEdges()
    surface.SetInputData(grid)
    edges.SetInputConnection(surface.GetOutputPort())
    edges.BoundaryEdgesOn(), edges.FeatureEdgesOff(), edges.ManifoldEdgesOff(), edges.NonManifoldEdgesOn()
    edges.Update()
    count = edges.GetOutput().GetNumberOfCells()
    expect(count == expected["boundary_edges"], f"{count} edges on one cell only, not {expected['boundary_edges']}")

    # Means over the polygons, against the report. Both add at most 1e5 numbers >= 0 in double: 1e5 x 2^-53 of relative error.
    polygon = grid.GetCellData().GetArray("polygon")
    mean = grid.GetCellData().GetArray("mean_radiosity")
    report = expected["report"]
    unit = fields["unit"][0].replace("/", "_").replace("^", "")
    for p, want in enumerate(report["polygons"]):
        cells = [i for i in range(grid.GetNumberOfCells()) if polygon.GetValue(i) == p]
        total = sum(given.GetValue(i) for i in cells)
        expect(abs(total - want["area_m2"]) <= 1e-11 * total, f"polygon {p} has an area of {total}")
        for band, radiosity in enumerate(want["radiosity_" + unit]):
            power = sum(given.GetValue(i) * mean.GetComponent(i, band) for i in cells)
            expect(abs(power / total - radiosity) <= 1e-11 * radiosity,
                   f"polygon {p} has a mean radiosity of {power / total}, and the report says {radiosity}")

    for failure in failures[:20]:
        print(failure)
    return 1 if failures else 0


sys.exit(main())
