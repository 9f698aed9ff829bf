"""Ask a cyclopean server from Rhino 8, without Grasshopper: do the selected meshes stand?

Start the server, `cyclopean serve --hops`, then run this file in Rhino 8 (command ScriptEditor, Python 3). It asks for
closed meshes, one a block; those on a layer whose name begins with "fixed" are held, or where there are none, those
that touch the lowest point. It prints the verdict, and draws contacts and forces on layers of their own.

Needs nothing but Rhino: the first half is plain Python, the second half is what only Rhino can do.
"""

import itertools
import json
import urllib.error
import urllib.request

ADDRESS = "http://127.0.0.1:5000"
SECONDS = 90  # the server ends a solve after 60


def item(value, kind=""):
    """One value as the server reads it; `kind` is the type of geometry whose JSON text the value is."""
    if kind:
        return {"type": "Rhino.Geometry." + kind, "data": value}
    names = {bool: "System.Boolean", int: "System.Int32", float: "System.Double", str: "System.String"}
    return {"type": names[type(value)], "data": json.dumps(value)}


def solve(component, inputs, units, address=ADDRESS, seconds=SECONDS):
    """Have a component solved.

    Parameters
    ----------
    component : str
        Such as "check".
    inputs : dict
        Lists of items by the names of the inputs.
    units : str
        Of the document, such as "Millimeters".

    Returns
    -------
    dict
        Lists of values by the names of the outputs; a list of lists where there is a branch for each contact.

    Raises
    ------
    RuntimeError
        What the server says is wrong, or that it is not there.
    """
    values = [{"ParamName": name, "InnerTree": {"{0}": items}} for name, items in inputs.items()]
    body = json.dumps({"pointer": component, "modelunits": units, "values": values}).encode("utf-8")
    request = urllib.request.Request(address + "/solve", body, {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request, timeout=seconds) as answer:
            said = json.load(answer)
    except urllib.error.HTTPError as error:  # the reason is in its body all the same
        said = json.load(error)
    except OSError as error:
        raise RuntimeError(f"no server answers at {address} ({error}); start it with: cyclopean serve --hops") from None
    if said["errors"]:
        raise RuntimeError("; ".join(said["errors"]))
    return {value["ParamName"]: branches(value["InnerTree"]) for value in said["values"]}


def branches(tree):
    """The values of one output."""
    read = {path: [json.loads(entry["data"]) for entry in entries] for path, entries in tree.items()}
    return read.get("{0}", list(read.values()))


# What follows runs in Rhino only.


def chosen():
    """Meshes that a person picks, as JSON text, and whether each is held."""
    import Rhino
    import scriptcontext

    asked = Rhino.Input.Custom.GetObject()
    asked.SetCommandPrompt("Closed meshes, one for each block")
    asked.GeometryFilter = Rhino.DocObjects.ObjectType.Mesh
    if asked.GetMultiple(1, 0) != Rhino.Input.GetResult.Object:
        return [], []
    things = [asked.Object(k).Object() for k in range(asked.ObjectCount)]
    layers = [scriptcontext.doc.Layers[thing.Attributes.LayerIndex].Name for thing in things]
    plain = Rhino.FileIO.SerializationOptions()
    return [thing.Geometry.ToJSON(plain) for thing in things], [name.lower().startswith("fixed") for name in layers]


def draw(found):
    """Contacts and forces into the document, each on a layer of its own."""
    import Rhino
    import scriptcontext

    point = Rhino.Geometry.Point3d
    for curve in itertools.chain(*found["Contacts"]):
        outline = Rhino.Runtime.CommonObject.FromJSON(json.dumps(curve))
        scriptcontext.doc.Objects.AddCurve(outline, on_layer("cyclopean contacts"))
    for line in itertools.chain(*found["Forces"]):
        ends = [point(end["X"], end["Y"], end["Z"]) for end in (line["From"], line["To"])]
        scriptcontext.doc.Objects.AddLine(ends[0], ends[1], on_layer("cyclopean forces"))
    scriptcontext.doc.Views.Redraw()


def on_layer(name):
    """Attributes of an object on a layer, which is made where there is none."""
    import Rhino
    import scriptcontext

    layer = scriptcontext.doc.Layers.FindName(name)
    attributes = Rhino.DocObjects.ObjectAttributes()
    attributes.LayerIndex = scriptcontext.doc.Layers.Add(name, attributes.ObjectColor) if layer is None else layer.Index
    return attributes


def main():
    """Ask, and show the answer."""
    try:
        import scriptcontext
    except ImportError:
        print("This runs in Rhino 8: open it in the ScriptEditor there. The server: cyclopean serve --hops")
        return
    meshes, held = chosen()
    if not meshes:
        return
    inputs = {"Blocks": [item(mesh, "Mesh") for mesh in meshes]}
    if any(held):
        inputs["Fixed"] = [item(one) for one in held]
    try:
        found = solve("check", inputs, str(scriptcontext.doc.ModelUnitSystem))
    except RuntimeError as error:
        print(f"cyclopean: {error}")
        return
    print(f"{found['Verdict'][0]}: {found['Reason'][0]}")
    draw(found)


if __name__ == "__main__":
    main()
