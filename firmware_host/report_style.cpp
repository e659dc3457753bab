#include "firmware_host/report_style.hpp"

namespace tactus::firmware {

// Fonts are the reader's own: the file must not fetch anything. Light and dark follow the system; print is
// light.
const std::string_view kReportStyle = R"css(
:root{color-scheme:light dark;--bg:#f7f6f3;--card:#fff;--ink:#1c1d1f;--soft:#5d6066;--faint:#8b8e94;--rule:#e3e1dc;
--grid:#ebe9e4;--accent:#1c64c4;--band:#1c64c433;--truth:#3b3d42;--budget:#b3541e;--good:#1b7f4d;--bad:#b3261e;
--warn-bg:#fdf1e3;--track:#eceae5;--out:#b9b6ae}
@media (prefers-color-scheme:dark){:root{--bg:#121316;--card:#1a1c20;--ink:#e9e9e7;--soft:#a6a9b0;--faint:#7d8087;
--rule:#2c2f35;--grid:#282b31;--accent:#69a7ff;--band:#69a7ff38;--truth:#d9d6cc;--budget:#f09a5b;--good:#56c48c;
--bad:#ff8a80;--warn-bg:#33271a;--track:#2a2d33;--out:#565a63}}
@media print{:root{--bg:#fff}section{break-inside:avoid}}
*{box-sizing:border-box}
body{margin:0;background:var(--bg);color:var(--ink);font:15px/1.5 system-ui,-apple-system,"Segoe UI",Roboto,"Noto Sans","DejaVu Sans",sans-serif;
-webkit-text-size-adjust:100%}
main{max-width:1080px;margin:0 auto;padding:40px 24px 64px}
header{margin-bottom:24px}
.brand{font-size:13px;letter-spacing:.14em;text-transform:uppercase;color:var(--soft);margin:0 0 6px}
h1{font-size:30px;line-height:1.2;font-weight:650;margin:0 0 8px;letter-spacing:-.01em;overflow-wrap:anywhere}
h2{font-size:19px;font-weight:650;margin:0 0 12px}
h3{font-size:14px;font-weight:600;margin:0 0 6px;color:var(--soft)}
p{margin:0 0 12px}.lead{color:var(--soft);max-width:72ch;margin-bottom:0}
section{background:var(--card);border:1px solid var(--rule);border-radius:10px;padding:22px 24px;margin-top:18px}
section>p.about{color:var(--soft);max-width:80ch;margin:-8px 0 16px}
.tiles{display:grid;grid-template-columns:repeat(auto-fit,minmax(225px,1fr));gap:12px;margin-top:18px}
.tile{background:var(--card);border:1px solid var(--rule);border-radius:10px;padding:14px 16px}
.tile .name{color:var(--soft);font-size:13px}.tile .figure{font-size:26px;font-weight:650;line-height:1.25;letter-spacing:-.01em;white-space:nowrap}
.tile .figure small{font-size:14px;font-weight:500;color:var(--soft);letter-spacing:0}
.tile .detail{font-size:13px;color:var(--soft)}
.good .figure::after,.bad .figure::after{display:inline-block;font-size:15px;margin-left:8px;vertical-align:3px}
.good .figure::after{content:"✓";color:var(--good)}.bad .figure::after{content:"✕";color:var(--bad)}
.notes{list-style:none;margin:0;padding:0}.notes li{padding:7px 0;border-top:1px solid var(--rule)}.notes li:first-child{border-top:0}
.tag{display:inline-block;font-size:12px;font-weight:600;border-radius:4px;padding:0 7px;margin-right:10px;background:var(--track);color:var(--soft)}
.tag.warning{background:var(--warn-bg);color:var(--budget)}
figure{margin:0}img{display:block;width:100%;height:auto;border-radius:6px;background:var(--track);image-rendering:auto}
figcaption{font-size:13px;color:var(--soft);margin-top:6px}figcaption b{color:var(--ink);font-weight:600}
figure.film video{display:block;width:100%;max-height:480px;border-radius:6px;background:#000}a{color:var(--accent)}
.tiles.inner{grid-template-columns:repeat(auto-fit,minmax(170px,1fr));margin:18px 0 22px}.tiles.inner .tile{background:var(--bg)}
.pictures{display:grid;grid-template-columns:repeat(2,1fr);gap:20px}.pictures figure.wide{grid-column:1/-1}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(340px,1fr));gap:20px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:14px}
th{font-weight:600;color:var(--soft);font-size:13px;text-align:left;vertical-align:bottom}
th,td{padding:6px 14px 6px 0;border-bottom:1px solid var(--rule)}td{vertical-align:middle}
tr:last-child td{border-bottom:0}th:last-child,td:last-child{padding-right:0}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}.over{color:var(--bad);font-weight:600}
.why{color:var(--soft);font-size:13px;min-width:22ch}td.key{white-space:nowrap}
tfoot td{font-weight:600;border-top:2px solid var(--rule);border-bottom:0}
code,.mono{font-family:ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace;font-size:13px;overflow-wrap:anywhere}
dl{display:grid;grid-template-columns:max-content 1fr;gap:5px 22px;margin:0}dt{color:var(--soft)}dd{margin:0;overflow-wrap:anywhere}
.swatch{display:inline-block;width:14px;height:14px;border-radius:3px;vertical-align:-2px;margin-right:9px;border:1px solid #0003}
.meter{height:9px;border-radius:5px;background:var(--track);overflow:hidden;min-width:110px}.meter i{display:block;height:100%;background:var(--accent);border-radius:5px}
.meter.none i{background:var(--out)}
.legend{display:flex;flex-wrap:wrap;gap:4px 20px;font-size:13px;color:var(--soft);margin-top:10px}
.legend span::before{content:"";display:inline-block;width:18px;height:0;border-top:2px solid var(--accent);vertical-align:4px;margin-right:7px}
.legend .l-truth::before{border-top:1.5px dashed var(--truth)}.legend .l-budget::before{width:0;height:13px;border:0;border-left:2px solid var(--budget);vertical-align:-2px}
.legend .l-start::before,.legend .l-end::before{width:8px;height:8px;border:2px solid var(--accent);border-radius:50%;vertical-align:-1px}
.legend .l-start::before{background:var(--accent)}.legend .l-median::before{width:0;height:11px;border:0;border-left:2px solid var(--ink);vertical-align:-1px}
.legend .l-bar::before{height:7px;border:0;background:var(--accent);border-radius:2px;vertical-align:0}
.legend .l-max::before{border-top:2px solid var(--out)}
svg{display:block;width:100%;height:auto}svg.spark{width:220px;height:30px}svg.range{width:200px;height:20px}
.grid{stroke:var(--grid);fill:none}.tick{fill:var(--faint);font-size:12px}.line{stroke:var(--accent);stroke-width:1.6;fill:none;stroke-linejoin:round}
.spark .line{stroke-width:1.2}.band{fill:var(--band);stroke:none}.spike{fill:var(--accent)}
.budget{stroke:var(--budget);stroke-width:1.4;stroke-dasharray:5 4;fill:none}.range .budget{stroke-dasharray:none;stroke-width:2}
.budget-label{fill:var(--budget);font-size:12px}
.bar{stroke:var(--accent);stroke-width:8;fill:none}.bar.over{stroke:var(--bad)}.whisker{stroke:var(--out);stroke-width:2;fill:none}.median{stroke:var(--ink);stroke-width:2}
.truth{stroke:var(--truth);stroke-width:1.3;stroke-dasharray:4 3;fill:none}.look{stroke:var(--accent);stroke-opacity:.35;fill:none}
.start{fill:var(--accent)}.end{fill:var(--card);stroke:var(--accent);stroke-width:2}.scale{stroke:var(--soft);fill:none;stroke-width:1.4}
footer{color:var(--soft);font-size:13px;margin-top:22px}
@media (max-width:640px){main{padding:24px 14px 40px}.tiles{grid-template-columns:repeat(2,1fr)}.tile .figure{font-size:21px}section{padding:16px}.pictures{grid-template-columns:1fr}h1{font-size:24px}dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:8px}}
)css";

}  // namespace tactus::firmware
