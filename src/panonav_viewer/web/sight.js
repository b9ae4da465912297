// Of what plays by itself (a run, a map that unfolds) only the one that a person looks at does. A player has
// `seen(whether)` and `hold()`.
const players = new Map();  // to the share of the window that it fills
let current;

const observer = new IntersectionObserver(entries => {
  for (const { target, intersectionRatio, intersectionRect } of entries) {
    players.set(target, Math.max(intersectionRatio, intersectionRect.height / innerHeight));
  }
  const [best, share] = [...players].reduce((a, b) => b[1] > a[1] ? b : a, [undefined, 0.15]);
  if (best === current) return;
  current?.seen(false);
  current = best;
  current?.seen(true);
}, { threshold: [0, 0.15, 0.3, 0.4, 0.5, 0.6, 0.8, 1] });

export function watch(player) {
  players.set(player, 0);
  observer.observe(player);
}
// Those that stand side by side in `group` move together.
export function watchTogether(group, player) {
  if (!group.members) {
    group.members = [];
    group.seen = whether => group.members.forEach(member => member.seen(whether));
    group.hold = () => group.members.forEach(member => member.hold());
    watch(group);
  }
  group.members.push(player);
  if (current === group) player.seen(true);
}
export const inSight = () => current ?? players.keys().next().value;
export const moves = () => !matchMedia('(prefers-reduced-motion: reduce)').matches;

addEventListener('pointerdown', event => {  // a first click holds what plays by itself
  if (!event.target.closest('.controls')) current?.hold();
});

// Calls once when the element comes near to what is shown: long pages open at once.
export function whenNear(element, call) {
  const near = new IntersectionObserver(entries => {
    if (!entries.some(entry => entry.isIntersecting)) return;
    near.disconnect();
    call();
  }, { rootMargin: '800px' });
  near.observe(element);
}
