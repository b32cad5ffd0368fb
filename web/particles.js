// Painting particles: the places that the tracker compared. A particle is x, y, width, weight.

/** The power of ten of the share of the largest weight, at and below which a particle is painted faintest. */
const FAINTEST = -9;
/** How likely a particle is beside the likeliest one, on a logarithmic scale from 0 to 1.
 * @param {number[]} particle
 * @param {number} most */
export const shareOf = ([, , , weight], most) => Math.max(0, 1 - Math.log10(weight / most || Number.MIN_VALUE) / FAINTEST);

/** A colour from blue, for a share of 0, to yellow, for 1.
 * @param {number} share
 * @param {number} alpha */
export const colorOf = (share, alpha) => `hsl(${205 - 150 * share} 95% ${62 + 8 * share}% / ${alpha})`;

/** Paints particles as dots: larger and warmer for a larger weight.
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
