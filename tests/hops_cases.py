"""Requests as Hops of Rhino 8 sends them: the keys, their order and the text in "data" follow its `Schema.cs`."""

import contextlib
import json
import subprocess
import sys

import numpy as np

MILLIMETRES = 1000.0
CUBE = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
TYPES = {bool: "System.Boolean", float: "System.Double", int: "System.Int32", str: "System.String"}


def box(low, high):
    """Corners of a box, and its faces."""
    (x, y, z), (u, v, w) = low, high
    corner = [(x, y, z), (u, y, z), (u, v, z), (x, v, z), (x, y, w), (u, y, w), (u, v, w), (x, v, w)]
    return np.array(corner, float), CUBE


def mesh(corners, faces, scale=MILLIMETRES, double=False):
    """A mesh as `Mesh.ToJSON` writes it: every face has corners of its own, as in the meshes of Rhino's boxes."""
    import rhino3dm

    made = rhino3dm.Mesh()
    made.Vertices.UseDoublePrecisionVertices = double
    for face in faces:
        first = len(made.Vertices)
        for k in face:
            x, y, z = (scale * np.asarray(corners[k])).tolist()
            made.Vertices.AddPoint3d(x, y, z) if double else made.Vertices.Add(x, y, z)
        made.Faces.AddFace(*range(first, first + len(face)))
    archive = made.Encode()  # Rhino writes the numbers as numbers
    return Geometry("Mesh", {k: v if k == "data" else int(v) for k, v in archive.items()})


class Geometry(dict):
    """Plain data with the name of a type of Rhino's."""

    def __init__(self, kind, data):
        super().__init__(data)
        self.kind = f"Rhino.Geometry.{kind}"


def vector(x, y, z):
    """As Newtonsoft writes a Vector3d."""
    return Geometry("Vector3d", {"X": x, "Y": y, "Z": z, "IsUnitVector": False})


def item(value):
    """One value of a data tree."""
    return {"type": getattr(value, "kind", TYPES.get(type(value))), "data": json.dumps(value)}


def tree(name, values):
    """An input: nothing, one value, or a list of them in one branch."""
    rows = values if isinstance(values, list) else [values]
    return {"ParamName": name, "InnerTree": {"{0}": [item(v) for v in rows]} if rows else {}}


def request(pointer, inputs, units="Millimeters"):
    """The body of a solve."""
    return {
        "absolutetolerance": 0.01,
        "angletolerance": 1.0,
        "modelunits": units,
        "dataversion": 7,
        "algo": None,
        "pointer": pointer,
        "cachesolve": False,
        "values": [tree(name, values) for name, values in inputs.items()],
        "warnings": [],
        "errors": [],
    }


def outputs(answer):
    """Values of an answer by name: {path: [value, ...]}, read back as Hops does."""
    found = {}
    for value in answer["values"]:
        branches = value["InnerTree"]
        found[value["ParamName"]] = {path: [json.loads(row["data"]) for row in rows] for path, rows in branches.items()}
    return found


def one(answer, name):
    """The only value of an output."""
    (branch,) = outputs(answer)[name].values()
    (value,) = branch
    return value


def points(archive):
    """Corners of a mesh or polyline of an answer."""
    import rhino3dm

    made = rhino3dm.CommonObject.Decode(archive)
    if isinstance(made, rhino3dm.Mesh):
        return np.array([(p.X, p.Y, p.Z) for p in made.Vertices.ToPoint3dArray()])
    line = made.ToPolyline()
    return np.array([(line[k].X, line[k].Y, line[k].Z) for k in range(len(line))])


def tower():
    """A block on a block; the lower one is held because it touches the lowest point."""
    return [mesh(*box((0, 0, 0), (1, 1, 1))), mesh(*box((0, 0, 1), (1, 1, 2)))]


def two_stones():
    """Stones a little larger than a block of the tower, lying about."""
    return [mesh(*box((5, 0, 0), (6.1, 1.1, 1.2))), mesh(*box((8, 0, 0), (9.2, 1.1, 1.1)))]


@contextlib.contextmanager
def serving(*options):
    """A server of its own process; its address, and the process."""
    command = [sys.executable, "-m", "cyclopean", "serve", "--hops", "--port", "0", *map(str, options)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        line = process.stdout.readline()
        assert "http://127.0.0.1:" in line, line + process.stderr.read()
        yield line.split("http://")[1].split()[0], process
    finally:
        process.kill()
        process.communicate()
