/** Rows of a long list, of which only those in view exist, and those that keyboard and screen readers
 * need: the first, the last, unfolded ones, and those beside the focus. */

import { Component, html } from '../../vendor/preact.js';

/** Pixels above and below the window in which rows exist already. */
const MARGIN = 300;

/** Height of a folded row in pixels, until one has been measured. */
const ROW_HEIGHT = 67;

/** @typedef {{rows: number[], nameOf: (row: number) => string, isOpen: (row: number) => boolean,
 *   render: (row: number) => unknown, label: string}} Props
 * @typedef {{first: number, last: number, focus: number}} Range places in `rows`; focus: -1 for none */

/** @extends {Component<Props, Range>} */
export class VirtualRows extends Component {
  /** @override @type {Range} */
  state = { first: 0, last: 12, focus: -1 };
  /** @type {HTMLElement | null} */
  element = null;
  /** Heights of folded and of unfolded rows that have been seen.
   * @type {Record<'folded' | 'unfolded', Map<number, number>>} */
  heights = { folded: new Map(), unfolded: new Map() };
  /** Height of a row that has not. */
  rowHeight = ROW_HEIGHT;
  frame = 0;

  componentDidMount() {
    // Any box around the list may scroll, and scrolling does not bubble.
    addEventListener('scroll', this.schedule, { capture: true, passive: true });
    addEventListener('resize', this.schedule);
    this.update();
  }

  componentDidUpdate() {
    this.measure();
    this.schedule();
  }

  componentWillUnmount() {
    removeEventListener('scroll', this.schedule, { capture: true });
    removeEventListener('resize', this.schedule);
    cancelAnimationFrame(this.frame);
  }

  schedule = () => {
    this.frame ||= requestAnimationFrame(() => {
      this.frame = 0;
      this.update();
    });
  };

  /** Note the heights of the rows that exist, which the others are likely to have. */
  measure() {
    for (const item of this.items()) {
      const { height } = item.getBoundingClientRect();
      const row = this.props.rows[Number(item.getAttribute('aria-posinset')) - 1];
      if (row !== undefined && height) this.heightsLike(row).set(row, height);
    }
    const folded = [...this.heights.folded.values()];
    if (!folded.length) return;
    const mean = folded.reduce((a, b) => a + b) / folded.length;
    if (Math.abs(mean - this.rowHeight) < 1) return;
    this.rowHeight = mean;
    this.forceUpdate();
  }

  /** @returns {HTMLElement[]} */
  items() {
    const children = /** @type {HTMLElement[]} */ ([...(this.element?.children ?? [])]);
    return children.filter((child) => child.getAttribute('role') === 'listitem');
  }

  /** Find the rows in view. */
  update() {
    if (!this.element) return;
    const { rows } = this.props;
    const { top, height } = this.element.getBoundingClientRect();
    if (!height && rows.length) return; // in a panel that is not shown
    let [first, last, y] = [-1, 0, top];
    rows.forEach((row, place) => {
      const bottom = y + this.heightOf(row);
      if (bottom >= -MARGIN && first < 0) first = place;
      if (y <= innerHeight + MARGIN) last = place;
      y = bottom;
    });
    if (first < 0) first = rows.length - 1;
    if (first !== this.state.first || last !== this.state.last) this.setState({ first, last });
  }

  /** @param {number} row */
  heightsLike(row) {
    return this.props.isOpen(row) ? this.heights.unfolded : this.heights.folded;
  }

  /** @param {number} row */
  heightOf(row) {
    return this.heightsLike(row).get(row) ?? this.rowHeight;
  }

  /** @param {FocusEvent} event */
  follow = ({ type, target }) => {
    const item = type === 'focusin' && /** @type {Element} */ (target).closest('[role=listitem]');
    this.setState({ focus: item ? Number(item.getAttribute('aria-posinset')) - 1 : -1 });
  };

  /** Whether the row at a place exists. @param {number} place */
  exists(place) {
    const { first, last, focus } = this.state;
    const { rows, isOpen } = this.props;
    if (place >= first && place <= last) return true;
    if (place === 0 || place === rows.length - 1 || isOpen(rows[place])) return true;
    return focus >= 0 && Math.abs(place - focus) <= 1;
  }

  render() {
    const { rows, nameOf, render, label } = this.props;
    /** @type {unknown[]} */
    const shown = [];
    let gap = 0;
    const addGap = (/** @type {string} */ key) => {
      if (gap) shown.push(html`<div key=${`before ${key}`} aria-hidden="true" style=${{ height: `${gap}px` }}></div>`);
      gap = 0;
    };
    rows.forEach((row, place) => {
      if (!this.exists(place)) {
        gap += this.heightOf(row);
        return;
      }
      const name = nameOf(row);
      addGap(name);
      shown.push(html`<div key=${name} role="listitem" aria-setsize=${rows.length}
        aria-posinset=${place + 1}>${render(row)}</div>`);
    });
    return html`<div class="light-rows" role="list" aria-label=${label}
      ref=${(/** @type {HTMLElement | null} */ element) => (this.element = element)}
      onfocusin=${this.follow} onfocusout=${this.follow}>${shown}</div>`;
  }
}
