// Style and script of the bench report's page.
#pragma once

namespace kairos {

/// CSS. Colours follow the reader's light or dark setting; methods have hues that remain apart under all
/// common colour vision deficiencies (after Okabe and Ito 2008), budgets a scale of rising lightness.
constexpr const char* kBenchStyle = R"(
:root{color-scheme:light dark;
--page:#fcfbf9;--raised:#f3f1ec;--text:#1c1e22;--muted:#6a6e76;--grid:#e7e4de;--rule:#d8d4cb;--strong:#00735a;
--full:#7d828b;--segments:#2f9bd6;--dvrm:#c0628f;--tldvrm:#7a5bb5;--anytime:#00926b;--tcdvrm:#cf5300;--tiles:#b98900;--lowres:#1668a8;
--budget0:#4a1a8a;--budget1:#93268f;--budget2:#c94579;--budget3:#e67656;--budget4:#dd9a2b;--budget5:#8a8a00;
--stage0:#5b7fa6;--stage1:#c98a2b;--stage2:#00926b;--stage3:#9b6aa8;--stage4:#b9b4a8}
@media(prefers-color-scheme:dark){:root{
--page:#131519;--raised:#1c1f25;--text:#e9e7e2;--muted:#989ca5;--grid:#272b32;--rule:#363b44;--strong:#5fd3b0;
--full:#a3a8b0;--segments:#6cc0f0;--dvrm:#e59abf;--tldvrm:#b39be3;--anytime:#2cc295;--tcdvrm:#f5833f;--tiles:#e8bb45;--lowres:#5aa7e0;
--budget0:#a98af0;--budget1:#d07fd6;--budget2:#f0829f;--budget3:#f9a07e;--budget4:#f2c46b;--budget5:#e6e68a;
--stage0:#7fa3cc;--stage1:#e3ab54;--stage2:#2cc295;--stage3:#bd92ca;--stage4:#6c6a63}}
*{box-sizing:border-box}
html{scroll-behavior:smooth}
body{margin:0 auto;max-width:1200px;padding:48px 28px 96px;background:var(--page);color:var(--text);
font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif;-webkit-font-smoothing:antialiased}
h1{font-size:34px;line-height:1.15;letter-spacing:-.018em;font-weight:680;margin:0 0 10px;text-wrap:balance}
h2{font-size:22px;line-height:1.25;letter-spacing:-.01em;font-weight:650;margin:0 0 6px}
h3{font-size:17px;margin:34px 0 10px}h4{font-size:14px;font-weight:600;color:var(--muted);margin:26px 0 10px}
p{margin:0 0 12px}
.eyebrow{font-size:13px;letter-spacing:.06em;text-transform:uppercase;color:var(--muted);margin:0 0 10px}
.summary{font-size:18px;max-width:62em;text-wrap:pretty}
.lead{color:var(--muted);max-width:68em;margin-bottom:22px}
.note{color:var(--muted);font-size:14px}
.warning{border-left:3px solid var(--tcdvrm);padding:6px 14px;background:var(--raised);border-radius:0 6px 6px 0;max-width:68em}
section{padding-top:34px;margin-top:44px;border-top:1px solid var(--rule)}
nav{display:flex;flex-wrap:wrap;gap:4px 18px;font-size:14px;margin:26px 0 0}
a{color:inherit;text-decoration-color:var(--rule);text-underline-offset:3px}a:hover{text-decoration-color:currentColor}
dl{display:grid;grid-template-columns:max-content minmax(0,1fr);gap:5px 20px;font-size:14px;margin:26px 0 0}
dt{color:var(--muted)}dd{margin:0;overflow-wrap:anywhere}
code{font:13px/1.5 ui-monospace,SFMono-Regular,Menlo,Consolas,"DejaVu Sans Mono",monospace}
.grid{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,480px),1fr));gap:34px 36px}
figure{margin:0 0 8px;min-width:0;overflow-x:auto}
figcaption{font-size:13px;color:var(--muted);padding:4px 0;font-variant-numeric:tabular-nums}
figcaption b{color:var(--text);font-weight:600}
.legend{display:flex;flex-wrap:wrap;gap:4px 18px;align-items:center;font-size:13px;color:var(--muted);margin:0 0 14px}
.legend span{display:inline-flex;align-items:center;gap:7px}.legend .dot{margin:0}.legend svg{width:26px;min-width:26px!important;height:12px}
.ramp i{display:inline-block;width:13px;height:13px;margin-right:-7px}.ramp{padding-right:7px}
.overview{max-width:640px}
.dot{display:inline-block;width:9px;height:9px;border-radius:50%;background:currentColor;margin-right:8px;vertical-align:0}
.scroll{overflow-x:auto}
table{border-collapse:collapse;width:100%;font-size:13.5px;font-variant-numeric:tabular-nums;line-height:1.4}
th{font-weight:500;text-align:left;white-space:nowrap}
thead th{color:var(--muted);font-size:12.5px;border-bottom:1px solid var(--rule);vertical-align:bottom;white-space:normal}
td,th{padding:5px 10px 5px 0}td.n,th.n{text-align:right;padding:5px 0 5px 16px;white-space:nowrap}thead th.n{white-space:normal}
tbody tr+tr>*{border-top:1px solid var(--grid)}
.best{font-weight:680;color:var(--strong)}
details{margin-top:14px}summary{cursor:pointer;font-size:13.5px;color:var(--muted);width:max-content;padding:3px 0}
summary:hover{color:var(--text)}
.cards{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(100%,252px),1fr));gap:14px 16px}
.card img,.shot{display:block;width:100%;border-radius:3px}
.shot{aspect-ratio:var(--aspect);background:#000 center/100% 100%;margin-bottom:4px;overflow:hidden}
.shot img{width:100%;height:100%}.shot:hover img{opacity:0}
.same{aspect-ratio:var(--aspect);display:grid;place-items:center;background:var(--raised);color:var(--muted);font-size:13px;border-radius:3px}
#tip{position:fixed;z-index:9;pointer-events:none;white-space:pre;background:var(--text);color:var(--page);font-size:12.5px;
line-height:1.45;padding:7px 11px;border-radius:6px;font-variant-numeric:tabular-nums;max-width:calc(100vw - 16px);display:none}
@media(max-width:620px){body{padding:28px 16px 64px}h1{font-size:27px}dl{grid-template-columns:1fr;gap:0}dd{margin-bottom:8px}}
@media print{body{max-width:none;padding:0}details>*{display:block}nav{display:none}section{break-inside:avoid-page}}
)";

/// JavaScript: titles of charts appear at once, beside the pointer. Without it they are the browser's own.
constexpr const char* kBenchScript = R"(
const tip=document.createElement('div');tip.id='tip';document.body.append(tip);
for(const title of document.querySelectorAll('svg .hover>title')){
  const mark=title.parentNode,text=title.textContent;
  mark.setAttribute('aria-label',text);title.remove();
  mark.addEventListener('pointermove',e=>{
    tip.textContent=text;tip.style.display='block';
    const box=tip.getBoundingClientRect();
    const x=e.clientX+16+box.width>innerWidth-8?e.clientX-16-box.width:e.clientX+16;
    tip.style.left=Math.max(8,x)+'px';
    tip.style.top=Math.max(8,Math.min(e.clientY+14,innerHeight-box.height-8))+'px'});
  mark.addEventListener('pointerleave',()=>tip.style.display='none')}
)";

}  // namespace kairos
