"""Two examples for every command, shown below its help; the tests see to it that their options exist."""

EXAMPLES: dict[str, tuple[str, ...]] = {
    "demo": ("cyclopean demo", "cyclopean demo --out results"),
    "check": (
        "cyclopean check arch.json --certificate proof.json --report arch.html",
        "cyclopean check stones.obj --units mm --mu 0.6 --supports below=0.01 --tilt 5",
    ),
    "limit": (
        "cyclopean limit arch.json --push 1,0,0 --report limit.html --certificate bounds.json",
        "cyclopean limit wall.json --tilt --polar 24 --report polar.html",
    ),
    "verify": ("cyclopean verify proof.json", "cyclopean verify proof.json --model arch.json"),
    "info": ("cyclopean info arch.json", "cyclopean info scans --units mm --strict --json inventory.json"),
    "convert": (
        "cyclopean convert arch.json arch.3dm --result result.json",
        "cyclopean convert drawing.obj stones.json --units mm --heal 0.002",
    ),
    "sequence": (
        "cyclopean sequence wall.json --out order.json --report building.html",
        "cyclopean sequence arch.json --out order.json --dot graph.dot",
    ),
    "match": (
        "cyclopean match scans wall.json --out matched --gap 0.2",
        "cyclopean match scans wall.json --out matched --negotiate 1 --report matched.html",
    ),
    "carve": (
        "cyclopean carve matched --out carved",
        "cyclopean carve matched/match.json --out carved --least-cut 0.005 --report carved.html",
    ),
    "ashlar": (
        "cyclopean ashlar --stone 0.4x0.2x0.2*200 --width 3 --height 2 --depth 0.2 --bond english --out wall.json",
        "cyclopean ashlar stock.csv --units mm --width 3 --height 2 --depth 0.2 --out wall.json --cutlist cuts.csv",
    ),
    "pack": (
        "cyclopean pack slabs.csv --width 3 --height 2 --depth 0.2 --out wall.json --svg wall.svg",
        "cyclopean pack slabs.csv --units mm --width 3 --height 2 --depth 0.2 --out wall.json --compare",
    ),
    "settle": (
        "cyclopean settle scans --out rubble.json --svg rubble.svg",
        "cyclopean settle scans --units mm --out rubble.json --wythes 2 --hearting",
    ),
    "view": ("cyclopean view arch.json", "cyclopean view result.json --out arch.html --no-browser"),
    "studio": (
        "cyclopean studio arch.json",
        "cyclopean studio wall.json --mu 0.7 --tilt 5 --no-browser --out results",
    ),
    "serve": ("cyclopean serve --hops", "cyclopean serve --hops --port 5001 --workers 2 --allow-folders scans"),
    "doctor": ("cyclopean doctor", "cyclopean doctor --json -"),
    "completion": (
        "cyclopean completion bash > ~/.local/share/bash-completion/completions/cyclopean",
        "cyclopean completion fish > ~/.config/fish/completions/cyclopean.fish",
    ),
    "make stack": ("cyclopean make stack 3 --out stack.json", "cyclopean make stack 5 --offset 0.1 --out leaning.json"),
    "make wall": (
        "cyclopean make wall 10 10 --out wall.json",
        "cyclopean make wall 8 12 --length 0.4 --height 0.2 --ground course --out wall.json",
    ),
    "make arch": (
        "cyclopean make arch 12 --span 3 --thickness 0.3 --out arch.json",
        "cyclopean make arch 20 --span 3 --rise 0.8 --springers fixed --out arch.json",
    ),
    "make vault": (
        "cyclopean make vault 12 6 --out vault.json",
        "cyclopean make vault 12 6 --radius 2 --thickness 0.3 --length 4 --out vault.json",
    ),
    "make dome": (
        "cyclopean make dome 6 12 --out dome.json",
        "cyclopean make dome 8 16 --radius 3 --thickness 0.3 --oculus 15 --out dome.json",
    ),
    "make retaining": (
        "cyclopean make retaining 4 6 --out wall.json",
        "cyclopean make retaining 4 6 --base 0.8 --friction 32 --wall-friction 20 --surcharge 5000 --out wall.json",
    ),
    "make bridge": (
        "cyclopean make bridge 16 --out bridge.json",
        "cyclopean make bridge 20 --span 8 --rise 2.5 --spread boussinesq --out bridge.json",
    ),
    "make polygonal": (
        "cyclopean make polygonal --width 3 --height 1.8 --seed 7 --out wall.json",
        "cyclopean make polygonal --opening 1.05,0,0.9,1.25 --improve J --out wall.json",
    ),
    "make stones": (
        "cyclopean make stones --count 60 --seed 1 --out stones.obj",
        "cyclopean make stones --count 200 --volume 30..200L --out stones.obj",
    ),
}
