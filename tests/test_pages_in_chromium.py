"""Every kind of page in a real browser: nothing in the console, nothing that is cut off, no words on other words.

On a desk in the dark and on a telephone in the light. Scenes in 3D are left out: they take long to start.
"""

import json
from pathlib import Path

import pytest

from chromium import Chromium
from cyclopean.cli import main as cyclopean

COMMANDS = """
make arch 7 --span 3 --thickness 0.5 --out arch.json
make polygonal --width 1.2 --height 0.8 --columns 3 --rows 2 --depth 0.3 --seed 3 --out wall.json --report wall.html
ashlar --stone 0.6x0.3x0.3*20 --width 1.5 --height 0.6 --depth 0.3 --out ashlar.json --report ashlar.html
make polygonal --width 1.5 --height 1 --columns 3 --rows 3 --depth 0.3 --seed 3 --corner 1 --out corner.json
make stones --out q --count 7 --seed 1 --detail 1
check arch.json --report stable.html --no-margins
check arch.json --tilt 40 --report unstable.html --no-margins
check corner.json --method rbe --report corner.html --no-margins
limit arch.json --push 1,0,0 --report limit.html
limit arch.json --load v04:0,0,-1000 --report loaded.html
sequence wall.json --method rbe --out order.json --report building.html
match q wall.json --out m --report match.html
carve m/match.json --method rbe --out c --report carve.html
settle q --length 1.2 --height 0.4 --yaws 2 --ways 1 --workers 1 --out settled.json --report settled.html
verify --page verify.html
"""

# What is wrong with a page: wider than the window; letters that reach out of their box or drawing; words over words.
FAULTS = """(()=>{
const found=[],wide=document.documentElement.clientWidth;
if(document.documentElement.scrollWidth>wide+1)found.push('page wider than the window');
for(const e of document.querySelectorAll('h1,h2,p,dt,dd,th,td,li,figcaption,.key,pre,label')){
 if(!e.offsetParent||e.closest('.wide,.rows'))continue;
 const b=e.getBoundingClientRect();
 if(b.right>wide+1||b.left<-1||e.scrollWidth>e.clientWidth+2&&getComputedStyle(e).display==='block')
  found.push('cut off: '+e.textContent.slice(0,40));}
for(const svg of document.querySelectorAll('figure svg')){
 const s=svg.getBoundingClientRect(),seen=[];
 for(const t of svg.querySelectorAll('text')){
  if(getComputedStyle(t).visibility==='hidden'||!t.textContent.trim())continue;
  const b=t.getBoundingClientRect();
  if(b.left<s.left-1||b.right>s.right+1||b.top<s.top-2||b.bottom>s.bottom+2)
   found.push('out of the drawing: '+t.textContent);
  for(const [o,words] of seen)
   if(Math.min(b.right,o.right)-Math.max(b.left,o.left)>2&&
      Math.min(b.bottom,o.bottom)-Math.max(b.top,o.top)>0.45*Math.min(b.height,o.height))
    found.push('over each other: '+t.textContent+' / '+words);
  seen.push([b,t.textContent]);}}
return JSON.stringify(found)})()"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """One small page of every kind, without its scene."""
    folder = tmp_path_factory.mktemp("pages")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr("cyclopean.view.markup.scene_html", lambda *_: "")
        for name in ("q", "m", "c"):
            Path(name).mkdir()
        for command in COMMANDS.strip().splitlines():
            assert cyclopean(command.split()) in {0, 1, 3}, command
    return sorted(folder.glob("*.html"))


@pytest.mark.parametrize(("look", "width"), [("dark", 1100), ("light", 390)])
def test_pages_are_whole(browser: Chromium, pages: list[Path], look: str, width: int) -> None:
    found = {}
    browser("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
    browser("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": look}])
    watch = "window.wrong=[];addEventListener('error',e=>wrong.push(e.message));"
    watch += "for(const k of ['error','warn'])console[k]=(...a)=>wrong.push(a.join(' '))"
    browser("Page.enable")
    script = browser("Page.addScriptToEvaluateOnNewDocument", source=watch)
    for page in pages:
        browser("Page.navigate", url=page.as_uri())
        browser.wait(f"document.readyState==='complete'&&location.href.endsWith('{page.name}')")
        found[page.stem] = [*json.loads(browser.js(FAULTS)), *browser.js("window.wrong")]
        dark = browser.js("getComputedStyle(document.body).backgroundColor") != "rgb(255, 255, 255)"
        assert dark == (look == "dark")
    browser("Page.removeScriptToEvaluateOnNewDocument", **script)
    assert len(found) == 12
    assert {name: faults for name, faults in found.items() if faults} == {}
