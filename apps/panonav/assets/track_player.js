const canvas = document.getElementById('map'), context = canvas.getContext('2d');
const slider = document.getElementById('slider'), button = document.getElementById('play');
const images = run.images;
const stateColours = { localised: '{{sky}}', ambiguous: '{{orange}}', lost: '{{vermilion}}' };
slider.max = images.length - 1;

// What is sure to be seen: references, true path, localised places.
const bounds = { left: Infinity, right: -Infinity, low: Infinity, high: -Infinity };
function include(point) {
  bounds.left = Math.min(bounds.left, point[0]); bounds.right = Math.max(bounds.right, point[0]);
  bounds.low = Math.min(bounds.low, point[1]); bounds.high = Math.max(bounds.high, point[1]);
}
run.references.forEach(include);
for (const image of images) {
  if (image.ground_truth) include(image.ground_truth);
  if (image.pose && image.state === 'localised') include(image.pose);
}
const margin = Math.max(run.spacing, 0.1);
bounds.left -= margin; bounds.right += margin; bounds.low -= margin; bounds.high += margin;

let scale = 1, shownWidth = 1, shownHeight = 1;
function fit() {
  const ratio = window.devicePixelRatio || 1;
  const wide = bounds.right - bounds.left, tall = bounds.high - bounds.low;
  shownWidth = canvas.clientWidth;
  scale = Math.min(shownWidth / wide, 0.7 * window.innerHeight / tall);
  shownHeight = Math.max(1, Math.round(scale * tall));
  canvas.style.height = shownHeight + 'px';
  canvas.width = Math.round(shownWidth * ratio); canvas.height = Math.round(shownHeight * ratio);
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
}
const middle = () => (bounds.left + bounds.right) / 2;
const px = x => shownWidth / 2 + (x - middle()) * scale;
const py = y => shownHeight - (y - bounds.low) * scale;

function circle(x, y, radius, fill, stroke, width) {
  context.beginPath(); context.arc(px(x), py(y), radius, 0, 2 * Math.PI);
  if (fill) { context.fillStyle = fill; context.fill(); }
  if (stroke) { context.strokeStyle = stroke; context.lineWidth = width || 1; context.stroke(); }
}
function path(points, colour) {  // null interrupts it
  context.strokeStyle = colour; context.lineWidth = 2; context.beginPath();
  let pen = false;
  for (const point of points) {
    if (!point) { pen = false; continue; }
    if (pen) context.lineTo(px(point[0]), py(point[1])); else context.moveTo(px(point[0]), py(point[1]));
    pen = true;
  }
  context.stroke();
}
function pointer(pose, length, colour) {
  context.strokeStyle = colour; context.lineWidth = 2.5; context.beginPath();
  context.moveTo(px(pose[0]), py(pose[1]));
  context.lineTo(px(pose[0]) + length * Math.cos(pose[2]), py(pose[1]) - length * Math.sin(pose[2]));
  context.stroke();
}
function scaleBar() {
  const length = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500].find(l => l * scale >= 60) || 1000;
  context.fillStyle = '#ffffffd0'; context.fillRect(6, shownHeight - 34, length * scale + 12, 30);
  context.strokeStyle = context.fillStyle = '#333'; context.lineWidth = 2; context.beginPath();
  context.moveTo(12, shownHeight - 12); context.lineTo(12 + length * scale, shownHeight - 12); context.stroke();
  context.font = '13px sans-serif'; context.fillText(length + ' m', 14, shownHeight - 18);
}

let shown = 0;
function draw() {
  const image = images[shown];
  context.clearRect(0, 0, shownWidth, shownHeight);
  const referenceRadius = Math.max(1.5, Math.min(5, 0.18 * run.spacing * scale));
  for (const [x, y] of run.references) circle(x, y, referenceRadius, null, '{{grey}}');
  const past = images.slice(0, shown + 1);
  path(past.map(i => i.ground_truth), '{{black}}');
  path(past.map(i => i.state === 'localised' ? i.pose : null), '{{blue}}');
  for (let p = 0; p < image.particles.length; p += 2) {
    circle(image.particles[p], image.particles[p + 1], 2, '{{vermilion}}b0');
  }
  if (image.pose) {
    const x = px(image.pose[0]), y = py(image.pose[1]);
    pointer(image.pose, 22, '{{blue}}');
    if (image.state === 'localised') { context.fillStyle = '{{blue}}'; context.fillRect(x - 6, y - 6, 12, 12); }
    else { context.strokeStyle = '{{blue}}'; context.lineWidth = 2; context.strokeRect(x - 6, y - 6, 12, 12); }
  }
  if (image.ground_truth) {
    circle(image.ground_truth[0], image.ground_truth[1], 10, null, '{{black}}', 2.5);
    if (image.ground_truth.length === 3) {
      const [x, y, h] = image.ground_truth;
      context.strokeStyle = '{{black}}'; context.lineWidth = 2.5; context.beginPath();
      context.moveTo(px(x) + 10 * Math.cos(h), py(y) - 10 * Math.sin(h));
      context.lineTo(px(x) + 22 * Math.cos(h), py(y) - 22 * Math.sin(h)); context.stroke();
    }
  }
  scaleBar();
  const state = document.getElementById('state');
  state.textContent = image.state; state.style.background = stateColours[image.state];
  const said = [`${image.file}, image ${shown + 1} of ${images.length}`];
  if (image.state === 'localised') said.push(`x ${image.pose[0].toFixed(2)} m, y ${image.pose[1].toFixed(2)} m`);
  if (image.state === 'localised' && image.error !== null) said.push(`error ${image.error.toFixed(2)} m`);
  if (image.state === 'ambiguous') said.push(image.modes === 1 ? 'one place, not yet sure' : `${image.modes} places`);
  said.push(`${image.count} particles` + (image.injected > 0 ? `, ${image.injected} drawn anew` : ''));
  document.getElementById('text').textContent = said.join(' \u00b7 ');
}
function show(index) { shown = index; slider.value = index; draw(); }

let timer = null;
function stop() { clearInterval(timer); timer = null; button.textContent = 'Play'; }
function start() {
  if (shown === images.length - 1) show(0);
  button.textContent = 'Pause';
  timer = setInterval(() => { if (shown < images.length - 1) show(shown + 1); else stop(); },
                      Number(document.getElementById('speed').value));
}
button.onclick = () => timer ? stop() : start();
document.getElementById('speed').onchange = () => { if (timer) { stop(); start(); } };
slider.oninput = () => { stop(); show(Number(slider.value)); };
window.onresize = () => { fit(); draw(); };
if (!images.some(image => image.ground_truth)) document.getElementById('truth-legend').remove();
fit();
draw();
