// The votes of the bag.

/** The votes as bars.
 * @param {HTMLCanvasElement} canvas
 * @param {number[]} votes */
export function showVotes(canvas, votes) {
  const ratio = devicePixelRatio;
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  const context = canvas.getContext("2d");
  if (!context || votes.length === 0) return;
  const most = Math.max(...votes);
  const width = canvas.width / votes.length;
  context.fillStyle = getComputedStyle(canvas).getPropertyValue("--accent");
  votes.forEach((vote, index) => {
    const height = (vote / most) * (canvas.height - 8 * ratio);
    context.fillRect(index * width + ratio, canvas.height - height, width - 2 * ratio, height);
  });
  const first = Math.round(100 * votes[0]);
  canvas.setAttribute("aria-label", `${votes.length} subspaces; the first has ${first} % of the vote`);
}
