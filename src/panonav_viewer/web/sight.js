// Plays only the animation (a run, a map that unfolds) that fills most of the window. A player has
// `setVisible(visible)` and `hold()`.
const players = new Map();  // by player: share of the window that it fills
let current;

const observer = new IntersectionObserver(entries => {
  for (const { target, intersectionRatio, intersectionRect } of entries) {
    players.set(target, Math.max(intersectionRatio, intersectionRect.height / innerHeight));
  }
  const [best, share] = [...players].reduce((a, b) => b[1] > a[1] ? b : a, [undefined, 0.15]);
  if (best === current) return;
  current?.setVisible(false);
  current = best;
  current?.setVisible(true);
}, { threshold: [0, 0.15, 0.3, 0.4, 0.5, 0.6, 0.8, 1] });

export function watch(player) {
  players.set(player, 0);
  observer.observe(player);
}
// Plays the animations of `group`, which stand side by side, together.
export function watchTogether(group, player) {
  if (!group.members) {
    group.members = [];
    group.setVisible = visible => group.members.forEach(member => member.setVisible(visible));
    group.hold = () => group.members.forEach(member => member.hold());
    watch(group);
  }
  group.members.push(player);
  if (current === group) player.setVisible(true);
}
export const inSight = () => current ?? players.keys().next().value;
export const moves = () => !matchMedia('(prefers-reduced-motion: reduce)').matches;

addEventListener('pointerdown', event => {  // a click pauses the animation that is playing
  if (!event.target.closest('.controls')) current?.hold();
});

// Calls once when the element comes near the visible part, so that long pages open fast, or when the page is printed.
export function whenNear(element, call) {
  let waiting = true;
  const start = () => { waiting = false; call(); };
  const near = new IntersectionObserver(entries => {
    if (!waiting || !entries.some(entry => entry.isIntersecting)) return;
    near.disconnect();
    start();
  }, { rootMargin: '800px' });
  near.observe(element);
  addEventListener('beforeprint', () => {
    if (!waiting) return;
    near.disconnect();
    start();
  }, { capture: true });  // before it is drawn for paper
}
