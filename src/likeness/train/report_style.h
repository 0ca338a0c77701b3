// The style sheet of report.html.

#pragma once

namespace likeness {

inline constexpr char kReportStyle[] = R"css(
:root {
  color-scheme: light dark;
  --ground: #f6f5f2; --panel: #ffffff; --ink: #1d1f23; --soft: #666c76; --rule: #e2e0da;
  --accent: #0b6e75; --held-out: #a85a00; --picture: #0c0d0f;
  --c0: #1d1f23; --c1: #0b6e75; --c2: #b4552d; --c3: #6a55a5; --c4: #8a7a1f;
}
@media (prefers-color-scheme: dark) {
  :root {
    --ground: #14161a; --panel: #1d2026; --ink: #e8eaee; --soft: #9aa1ac; --rule: #31353d;
    --accent: #5fd0d6; --held-out: #ffb547; --picture: #08090a;
    --c0: #e8eaee; --c1: #5fd0d6; --c2: #f08a5d; --c3: #b09bf0; --c4: #d8c455;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink); font: 16px/1.55 system-ui, sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 40px 24px 80px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 8px; letter-spacing: -0.01em; }
h2 { font-size: 20px; margin: 56px 0 6px; }
p { margin: 6px 0 14px; max-width: 76ch; }
.soft { color: var(--soft); }
code { font: 0.9em ui-monospace, "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(200px, 1fr)); gap: 14px; margin: 26px 0; }
.card { background: var(--panel); border: 1px solid var(--rule); border-radius: 10px; padding: 14px 18px; }
.card b { display: block; font-size: 28px; font-weight: 600; font-variant-numeric: tabular-nums; }
.card span { color: var(--soft); font-size: 14px; }
table { border-collapse: collapse; width: 100%; background: var(--panel); border: 1px solid var(--rule); }
th, td { padding: 9px 14px; text-align: right; border-bottom: 1px solid var(--rule); }
th { font-weight: 500; font-size: 14px; color: var(--soft); }
th:first-child, td:first-child { text-align: left; }
td { font-variant-numeric: tabular-nums; }
.scroll { overflow-x: auto; }
.row { margin: 18px 0 26px; }
.row figcaption { margin: 0 0 8px; display: flex; flex-wrap: wrap; gap: 4px 14px; align-items: baseline; }
.tag { font-size: 13px; font-weight: 600; color: var(--accent); }
.tag.held-out { color: var(--held-out); }
.two { display: grid; grid-template-columns: repeat(2, 1fr); gap: 8px; max-width: 780px; }
figure { margin: 0; }
.cell { background: var(--picture); border-radius: 6px; overflow: hidden; }
.cell img { display: block; width: 100%; }
.under { font-size: 13px; color: var(--soft); padding: 4px 2px 0; }
.legend { display: flex; gap: 10px; align-items: center; font-size: 13px; color: var(--soft); margin: 10px 0; }
.legend i { flex: 0 1 260px; height: 10px; border-radius: 5px; }
.chart { width: 100%; height: auto; background: var(--panel); border: 1px solid var(--rule); border-radius: 10px; }
.chart .grid { stroke: var(--rule); stroke-width: 1; }
.chart text { font: 12px system-ui, sans-serif; fill: var(--soft); stroke: none; }
.chart path { fill: none; stroke-width: 2; stroke-linejoin: round; }
.chart path.line-0 { stroke: var(--c0); } .chart text.line-0 { fill: var(--c0); }
.chart path.line-1 { stroke: var(--c1); } .chart text.line-1 { fill: var(--c1); }
.chart path.line-2 { stroke: var(--c2); } .chart text.line-2 { fill: var(--c2); }
.chart path.line-3 { stroke: var(--c3); } .chart text.line-3 { fill: var(--c3); }
.chart path.line-4 { stroke: var(--c4); } .chart text.line-4 { fill: var(--c4); }
.stage { display: grid; grid-template-columns: 120px 1fr 100px; gap: 12px; align-items: center; font-size: 14px; }
.stage i { display: block; height: 12px; background: var(--accent); border-radius: 3px; min-width: 2px; }
.stage span:last-child { text-align: right; font-variant-numeric: tabular-nums; }
li { margin: 8px 0; max-width: 80ch; }
@media (max-width: 640px) { main { padding: 24px 14px 60px; } .stage { grid-template-columns: 90px 1fr 84px; } }
)css";

}  // namespace likeness
