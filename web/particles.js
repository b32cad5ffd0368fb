// Particles: the places that the tracker compared.

/** A particle is as faint as can be from this share of the likeliest one's weight on, as a power of ten. */
const FAINTEST = -9;
/** From 0 to 1, how likely a particle is beside the likeliest one.
 * @param {number[]} particle
 * @param {number} most */
export const shareOf = ([, , , weight], most) => Math.max(0, 1 - Math.log10(weight / most || Number.MIN_VALUE) / FAINTEST);

/** From blue for the least likely to yellow.
 * @param {number} share
 * @param {number} alpha */
export const colorOf = (share, alpha) => `hsl(${205 - 150 * share} 95% ${62 + 8 * share}% / ${alpha})`;

/** Dots, the likelier the larger and warmer.
 * @param {CanvasRenderingContext2D} context
 * @param {number[][]} particles Likeliest first.
 * @param {number} unit A pixel of the screen. */
export function paintParticles(context, particles, unit) {
  const most = particles[0]?.[3] || 1;
  for (const particle of [...particles].reverse()) {
    const share = shareOf(particle, most);
    context.beginPath();
    context.arc(particle[0], particle[1], (1.1 + 1.6 * share) * unit, 0, 2 * Math.PI);
    context.fillStyle = colorOf(share, 0.35 + 0.6 * share);
    context.fill();
  }
}
