"""The style sheet of all pages: system fonts, one column, one accent a verdict, A4 in print."""

from cyclopean.view.colours import ACCENT, FORCE, GRAVITY, INK, LINE, SCALE, SOFT

_COMMON = """
:root{--ink:#23211d;--soft:#5b5750;--line:#dedbd3;--paper:#fff;--wash:#f7f6f2;--shade:#0003;color-scheme:light dark}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{margin:0;background:var(--paper);color:var(--ink);
font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
main{max-width:64rem;margin:0 auto;padding:2.5rem 1.5rem 4rem}
h1{font-size:1.05rem;font-weight:600;margin:0;overflow-wrap:anywhere}
h2{font-size:1.2rem;font-weight:600;margin:3.2rem 0 .9rem}
p{margin:.5rem 0;max-width:46rem}
.soft,figcaption{color:var(--soft)}
.soft,figcaption,footer{font-size:.9rem}
a{color:var(--accent)}
"""

_REPORT = """
header{display:flex;justify-content:space-between;gap:1rem;align-items:baseline;color:var(--soft)}
.verdict{margin:1.4rem 0 0;padding:1.5rem 1.7rem 1.4rem;border-left:.55rem solid var(--accent);background:var(--wash)}
.verdict strong{display:block;font-size:clamp(2.6rem,7vw,4rem);line-height:1.05;font-weight:700;letter-spacing:-.02em;
color:var(--accent)}
.verdict strong{overflow-wrap:anywhere}input{max-width:100%}
.verdict p{text-wrap:pretty;font-size:1.15rem;margin:.6rem 0 0;overflow-wrap:anywhere}
.counts{display:flex;flex-wrap:wrap;gap:.4rem 2.2rem;margin:1.3rem 0 0;padding:0}
.counts div{display:flex;gap:.45rem;align-items:baseline}
.counts dt{order:2;color:var(--soft)} .counts dd{margin:0;font-weight:600;font-variant-numeric:tabular-nums}
figure{margin:0} figure+figure{margin-top:2rem} figure svg{display:block;width:100%;height:auto}
figcaption{margin:.7rem 0 0;max-width:50rem}
.scene iframe{display:block;width:100%;aspect-ratio:3/2;max-height:80vh;border:1px solid var(--line);
border-radius:.3rem;
background:#fff;color-scheme:light}
.elevation svg{max-height:38rem}
svg,svg text{font-family:inherit}
.legend{display:flex;flex-wrap:wrap;gap:.7rem 1.8rem;align-items:flex-end;margin:0 0 1rem;font-size:.9rem}
.key{display:flex;align-items:center;gap:.5rem}
.key svg{width:2rem;height:1rem;flex:none}
.overlay{display:flex;gap:.5rem;align-items:center;font-weight:600;cursor:pointer}
.overlay input{width:1.1rem;height:1.1rem;accent-color:var(--accent)}
html:not(:has(#overlay:checked)) .overlay+.ramp{opacity:.45}
.wide{overflow-x:auto;background:linear-gradient(90deg,var(--paper) 2rem,transparent) 0 0/3rem 100% no-repeat local,
linear-gradient(270deg,var(--paper) 2rem,transparent) 100% 0/3rem 100% no-repeat local,
linear-gradient(90deg,var(--shade),transparent) 0 0/.9rem 100% no-repeat scroll,
linear-gradient(270deg,var(--shade),transparent) 100% 0/.9rem 100% no-repeat scroll}
.rows{max-height:40rem;overflow:auto;border:1px solid var(--line);border-radius:.3rem;padding:0 .8rem}
.rows thead th{position:sticky;top:0;background:var(--paper)}
table{border-collapse:collapse;width:100%;font-variant-numeric:tabular-nums}
th,td{text-align:left;padding:.42rem .9rem .42rem 0;border-bottom:1px solid var(--line);vertical-align:top}
th{font-weight:600;font-size:.88rem;color:var(--soft)}
thead th{border-bottom:1.5px solid #a9a59b;vertical-align:bottom}
tbody th{font-weight:500;color:var(--ink);font-size:1rem;overflow-wrap:break-word;max-width:20rem}
tbody tr:last-child>*{border-bottom:1.5px solid #a9a59b}
.n{text-align:right;white-space:nowrap} tbody th{min-width:8rem}
.bar{display:inline-block;width:4.2rem;height:.6rem;margin-left:.6rem;background:var(--line);vertical-align:middle}
.bar i{display:block;height:100%}
.tag{display:inline-block;padding:.02rem .55rem;border-radius:1rem;font-size:.82rem;border:1px solid}
.tag.assumed{color:#7a4b00;border-color:#c99b4e;background:#fdf6e7} .tag.given{color:#41504a;border-color:#b9c4bf}
.verdict .pulling{color:#b00020;font-weight:700}
.warnings{padding-left:1.1rem} .warnings li{margin:.3rem 0;overflow-wrap:anywhere}
pre{background:var(--wash);border:1px solid var(--line);border-radius:.3rem;padding:.7rem 1rem;margin:.6rem 0;
white-space:pre-wrap;overflow-wrap:anywhere;font:.92rem/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
code{font:.92em ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;overflow-wrap:anywhere}
.proof{display:grid;grid-template-columns:1fr 1fr;gap:.5rem 2.5rem}
.proof h3,.known h3{font-size:1rem;margin:1rem 0 .2rem} .known ul,.known ol{margin:.2rem 0;padding-left:1.3rem}
.known li{margin:.3rem 0;max-width:46rem;overflow-wrap:anywhere}
.proof ul{margin:.2rem 0;padding-left:1.1rem} .proof li{margin:.35rem 0}
footer{margin-top:3.5rem;padding-top:1rem;border-top:1px solid var(--line);color:var(--soft)}
.flat .scene{display:none} .flat .elevation{margin-top:0}
@media(max-width:40rem){main{padding:1.3rem 1rem 3rem}.verdict{padding:1.1rem 1.1rem}
.proof{grid-template-columns:1fr}header span{display:none}.counts{gap:.3rem 1.4rem}
h2{margin-top:2.4rem}.bar{display:none}tbody th{min-width:5rem}}
@media screen{.grain{filter:url(#grain)}}
@media screen and (prefers-color-scheme:dark){
:root{--ink:#ece8df;--soft:#b5aea2;--line:#4a453d;--paper:#1c1a17;--wash:#27241f;--shade:#000c}
.stable{--accent:#56bfae}.unstable{--accent:#ff8a5e}.undecided{--accent:#e2b04e}
.verdict .pulling{color:#ff8a8a}
.tag.assumed{color:#f0cf94;background:none}.tag.given{color:#c3cec9}
svg[fill=INK],figure>svg>[fill=INK]{fill:var(--ink)}svg [fill=SOFT],svg [fill=DARK]{fill:var(--soft)}
figure>svg>[stroke=INK],.key [stroke=INK],svg [stroke=DARK]{stroke:var(--ink)}
svg [stroke=SOFT]{stroke:var(--soft)}svg [stroke=LINE]{stroke:var(--line)}
[data-layer=numbers],[data-layer=shares]{fill:#33302b}[data-layer=cells] path{stroke:#8f887b}
svg [data-layer=paper]{display:none}svg [fill="#ffffff"]{fill:var(--paper)}
.key [stroke=BLUE]{stroke:#7fb0ff}.key [fill=BLUE]{fill:#7fb0ff}
svg text[stroke="#ffffff"]{stroke:var(--paper)}
}
@media print{
@page{size:A4;margin:17mm 16mm 18mm}
*{-webkit-print-color-adjust:exact;print-color-adjust:exact}
html{font-size:9.5pt} body{font-size:1rem;line-height:1.42}
section>p{break-after:avoid}
main{max-width:none;padding:0}
.scene{display:none} .elevation{margin-top:0} .elevation svg{max-height:84mm}
.verdict{padding:5mm 6mm;margin-top:5mm} .verdict strong{font-size:30pt} .verdict p{font-size:11.5pt}
h2{font-size:12.5pt;margin:6.5mm 0 2mm;break-after:avoid} figure,tr,.verdict,.legend,pre,.proof>div{break-inside:avoid}
thead{display:table-header-group} th,td{padding:1.1mm 3mm 1.1mm 0} tbody th{font-size:9.5pt} th{font-size:8.5pt}
.wide{overflow:visible;max-height:none} p,figcaption{max-width:none;orphans:3;widows:3}
footer{margin-top:6mm;break-before:avoid}
.key,.ramp{font-size:8.5pt}
}
"""


def sheet() -> str:
    """Style sheet of all pages."""
    accents = "".join(f".{word}{{--accent:{colour}}}" for word, colour in ACCENT.items())
    feared = "".join(f"html:has(#overlay:checked) .u{k}{{fill:{colour}}}" for k, colour in enumerate(SCALE))
    drawn = _REPORT
    for name, colour in {"=INK": INK, "=SOFT": SOFT, "=LINE": LINE, "=DARK": GRAVITY, "=BLUE": FORCE}.items():
        drawn = drawn.replace(name, f'="{colour}"')
    return (accents + feared + _COMMON + drawn).replace("\n", "")
