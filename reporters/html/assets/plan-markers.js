// Markers of findings on the map. Findings close to each other share one marker with a number.

/**
 * x and y in cm; members are indices of findings
 *
 * @typedef {object} Cluster
 * @property {number} x
 * @property {number} y
 * @property {Level} level
 * @property {number[]} members
 * @property {Box} box
 */

/** @param {readonly Finding[]} findings @param {number} index @returns {number} 0 is the worst */
function levelRank(findings, index) {
  return LEVELS.indexOf(findings[index]?.level ?? 'information');
}

class Markers {
  constructor() {
    /** @type {readonly Finding[]} */
    this.findings = [];
    /** @type {readonly number[]} */
    this.shown = [];
    this.scale = 0;
    /** @type {Cluster[]} */
    this.clusters = [];
  }

  /** @param {readonly Finding[]} findings @param {readonly number[]} shown indices of the findings that pass the filters */
  set(findings, shown) {
    this.findings = findings;
    this.shown = shown.filter((index) => findings[index]?.anchor);
    this.scale = 0;
  }

  /**
   * Returns the clusters for a scale. They change only at powers of √2, so they are stable while the map moves.
   *
   * @param {number} k
   */
  at(k) {
    const step = 2 ** (Math.floor(Math.log2(k) * 2) / 2);
    if (step !== this.scale) {
      this.scale = step;
      this.clusters = this.cluster((k * 100 > 6 ? 15 : 34) / step);
    }
    return this.clusters;
  }

  /** @param {number} side of a cell, in cm @returns {Cluster[]} worst on top */
  cluster(side) {
    /** @type {Map<string, Cluster>} */
    const cells = new Map();
    for (const index of this.shown) {
      const finding = this.findings[index];
      if (!finding?.anchor) continue;
      const { x, y } = finding.anchor;
      const key = `${Math.round(x / side)} ${Math.round(y / side)}`;
      const cell = cells.get(key);
      if (!cell) {
        cells.set(key, { x, y, level: finding.level, members: [index], box: [x, y, x, y] });
        continue;
      }
      cell.members.push(index);
      growBox(cell.box, [x, y, x, y]);
      if (LEVELS.indexOf(finding.level) < LEVELS.indexOf(cell.level)) cell.level = finding.level;
    }
    const list = [...cells.values()];
    for (const cell of list) {
      if (cell.members.length === 1) continue;
      cell.x = (cell.box[0] + cell.box[2]) / 2;
      cell.y = (cell.box[1] + cell.box[3]) / 2;
      cell.members.sort((a, b) => levelRank(this.findings, a) - levelRank(this.findings, b) || a - b);
    }
    return list.sort((a, b) => LEVELS.indexOf(b.level) - LEVELS.indexOf(a.level));
  }

  /**
   * Returns the topmost cluster at a pixel.
   *
   * @param {Frame} frame
   * @param {number} px
   * @param {number} py
   * @returns {Cluster|null}
   */
  pick(frame, px, py) {
    const clusters = this.at(frame.k);
    for (let i = clusters.length - 1; i >= 0; i--) {
      const cluster = clusters[i];
      if (!cluster) continue;
      const [x, y] = onFrame(frame, cluster.x, cluster.y);
      if (Math.hypot(x - px, y - py) <= clusterRadius(cluster) + 4) return cluster;
    }
    return null;
  }

  /**
   * @param {CanvasRenderingContext2D} canvas
   * @param {Frame} frame
   * @param {MapTheme} theme
   * @param {number} selected index
   */
  draw(canvas, frame, theme, selected) {
    const box = boxOfFrame(frame, 30);
    for (const cluster of this.at(frame.k)) {
      if (cluster.x < box[0] || cluster.x > box[2] || cluster.y < box[1] || cluster.y > box[3]) continue;
      const [x, y] = onFrame(frame, cluster.x, cluster.y);
      if (cluster.members.length > 1) drawCluster(canvas, cluster, x, y, theme);
      else if (cluster.members[0] !== selected) drawMarker(canvas, cluster.level, x, y, 6, theme);
    }
    const anchor = this.findings[selected]?.anchor;
    if (!anchor) return;
    const [x, y] = onFrame(frame, anchor.x, anchor.y);
    ring(canvas, x, y, 15, theme);
    drawMarker(canvas, this.findings[selected]?.level ?? 'information', x, y, 8, theme);
  }
}

/** @param {Cluster} cluster */
function clusterRadius(cluster) {
  return cluster.members.length === 1 ? 8 : 9 + Math.min(9, Math.log10(cluster.members.length) * 3.2);
}

/**
 * Draws the shape of a marker: a circle for errors, a triangle for warnings, a square for information.
 *
 * @param {CanvasRenderingContext2D} canvas
 * @param {Level} level
 * @param {number} x
 * @param {number} y
 * @param {number} size
 * @param {MapTheme} theme
 */
function drawMarker(canvas, level, x, y, size, theme) {
  canvas.beginPath();
  if (level === 'error') {
    canvas.arc(x, y, size, 0, 2 * Math.PI);
  } else if (level === 'warning') {
    canvas.moveTo(x, y - size * 1.25);
    canvas.lineTo(x + size * 1.2, y + size * 0.85);
    canvas.lineTo(x - size * 1.2, y + size * 0.85);
    canvas.closePath();
  } else {
    canvas.rect(x - size * 0.85, y - size * 0.85, size * 1.7, size * 1.7);
  }
  canvas.lineJoin = 'round';
  canvas.lineWidth = 5;
  canvas.strokeStyle = theme.halo;
  canvas.stroke();
  canvas.fillStyle = LEVEL_COLORS[level];
  canvas.fill();
  canvas.lineWidth = 1.2;
  canvas.strokeStyle = theme.ground;
  canvas.stroke();
}

/**
 * @param {CanvasRenderingContext2D} canvas
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 * @param {MapTheme} theme
 */
function ring(canvas, x, y, radius, theme) {
  canvas.beginPath();
  canvas.arc(x, y, radius, 0, 2 * Math.PI);
  canvas.lineWidth = 5.5;
  canvas.strokeStyle = theme.highlightHalo;
  canvas.stroke();
  canvas.lineWidth = 2.5;
  canvas.strokeStyle = theme.highlight;
  canvas.stroke();
}

/**
 * @param {CanvasRenderingContext2D} canvas
 * @param {Cluster} cluster
 * @param {number} x
 * @param {number} y
 * @param {MapTheme} theme
 */
function drawCluster(canvas, cluster, x, y, theme) {
  const radius = clusterRadius(cluster);
  const count = cluster.members.length;
  canvas.beginPath();
  canvas.arc(x, y, radius, 0, 2 * Math.PI);
  canvas.lineWidth = 6;
  canvas.strokeStyle = theme.halo;
  canvas.stroke();
  canvas.fillStyle = theme.cluster;
  canvas.fill();
  canvas.lineWidth = 2.6;
  canvas.strokeStyle = LEVEL_COLORS[cluster.level];
  canvas.stroke();
  canvas.fillStyle = theme.clusterText;
  canvas.font = '600 11px system-ui, sans-serif';
  canvas.textAlign = 'center';
  canvas.textBaseline = 'middle';
  canvas.fillText(count < 1000 ? String(count) : `${(count / 1000).toFixed(count < 10000 ? 1 : 0)}k`, x, y + 0.5);
}
