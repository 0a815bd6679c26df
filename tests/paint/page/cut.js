/**
 * What a person cannot read or reach on a painter's page: text that is cut where nothing shows all of
 * it, and controls that are not seen. What can be scrolled to is not cut, and what has all of its text
 * in a tip is not, where the keyboard reaches the tip.
 */

const CONTROLS = 'button, input, select, textarea, [role="slider"]';
const plain = (text) => text.replace(/\s+/g, ' ').trim();

/** Whether somebody who sees the page sees it. @param {Element} one */
function isShown(one) {
  const seen = one.checkVisibility({ opacityProperty: true, visibilityProperty: true });
  return seen && !one.closest('.only-read, .skips');
}

/** The part of a box that is seen, and what cuts the rest off: what scrolls there does not.
 * @param {DOMRect} rect @param {Element} inner @returns {Element | 'window' | null} */
function cutBy(rect, inner) {
  let { left, right, top, bottom } = rect;
  for (let one = inner; one; one = one.parentElement) {
    const { overflowX, overflowY, position } = getComputedStyle(one);
    const box = one.getBoundingClientRect();
    const isOver = { x: left < box.left - 1 || right > box.right + 1, y: top < box.top - 1 || bottom > box.bottom + 1 };
    // A sentence that goes on beside its panel is cut, though the panel could be moved.
    const isStrip = one.matches('.looks ul, .views');
    if (isOver.x && overflowX !== 'visible' && !isStrip) return one;
    if (isOver.y && ['hidden', 'clip'].includes(overflowY)) return one;
    // What scrolls brings it to where the box is.
    if (isStrip) [left, right] = [Math.max(left, box.left), Math.min(right, box.right)];
    if (['auto', 'scroll'].includes(overflowY)) [top, bottom] = [Math.max(top, box.top), Math.min(bottom, box.bottom)];
    if (left > right || top > bottom) return null; // scrolled away
    if (position === 'fixed' || one.tagName === 'DIALOG') break;
  }
  const isOut = left < -1 || top < -1 || right > innerWidth + 1 || bottom > innerHeight + 1;
  return isOut ? 'window' : null;
}

/** Whether all of a text is in a tip that keyboard and pointer reach. @param {Element} one
 * @param {string} text */
function isInTip(one, text) {
  const owner = one.closest('[data-tip]');
  if (!owner || !plain(owner.dataset.tip).includes(plain(text))) return false;
  const reached = [owner, ...owner.querySelectorAll(CONTROLS)];
  return reached.some((its) => its.tabIndex >= 0 && !its.disabled && isShown(its));
}

/** Text on a line of its own, in the font of an element, in CSS pixels. @param {string} text
 * @param {Element} one */
function widthOf(text, one) {
  const context = document.createElement('canvas').getContext('2d');
  // The shorthand is empty where figures are asked to be of one width.
  const { fontStyle, fontWeight, fontSize, fontFamily } = getComputedStyle(one);
  context.font = `${fontStyle} ${fontWeight} ${fontSize} ${fontFamily}`;
  return context.measureText(text).width;
}

/** Text of fields and lists, which no text node has. @param {HTMLElement} one */
function cutInField(one) {
  const style = getComputedStyle(one);
  const room = one.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
  const text = one.tagName === 'SELECT' ? (one.selectedOptions[0]?.text ?? '') : one.value;
  return widthOf(text, one) > room + 0.5 && !isInTip(one, text) ? text : null;
}

/** In one line each, of what is seen in an element. @param {Element} root @returns {string[]} */
export function cutOff(root) {
  const found = new Set();
  const walker = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const one = node.parentElement;
    if (!plain(node.data) || !isShown(one)) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const rects = [...range.getClientRects()].filter(({ width, height }) => width && height);
    const by = rects.map((rect) => cutBy(rect, one)).find(Boolean);
    // Of what is said of a place under the pointer, parts that have no room are left out whole.
    const isLeftOut = by?.matches?.('.here') && rects.every(({ top }) => top >= by.getBoundingClientRect().bottom);
    const whole = one.closest('.its-name, option')?.textContent ?? node.data;
    if (by && !isLeftOut && !isInTip(one, whole))
      found.add(`“${plain(node.data)}” is cut by ${by.className ?? by}`);
  }
  for (const one of root.querySelectorAll(CONTROLS)) {
    if (!isShown(one)) continue;
    const name = one.ariaLabel ?? plain(one.textContent);
    const box = one.getBoundingClientRect();
    const by = box.width && cutBy(box, one);
    if (by) found.add(`the control ${name} is cut by ${by.className ?? by}`);
    const group = one.closest('.choice')?.getBoundingClientRect();
    if (group && box.width && (box.left < group.left - 1 || box.right > group.right + 1))
      found.add(`the control ${name} sticks out of its group`);
    const { scrollWidth, clientWidth } = one;
    if (one.tagName === 'BUTTON' && scrollWidth > clientWidth + 1 && !isInTip(one, one.textContent))
      found.add(`the text of ${name} sticks out of it`);
    const isField = one.tagName === 'SELECT' || (one.tagName === 'INPUT' && one.type === 'text');
    const text = isField ? cutInField(one) : null;
    if (text) found.add(`“${text}” is cut in its field ${name}`);
    const under = box.width && !by && cover(one, box);
    if (under) found.add(`the control ${name} lies under ${under.className}`);
  }
  return [...found];
}

/** What lies over the middle of a control, where that is in sight. @param {Element} one
 * @param {DOMRect} box */
function cover(one, box) {
  const [x, y] = [box.left + box.width / 2, box.top + box.height / 2];
  const top = document.elementFromPoint(x, y);
  if (!top || one.disabled || one.contains(top) || top.contains(one)) return null;
  for (let outer = one.parentElement; outer; outer = outer.parentElement) {
    const its = outer.getBoundingClientRect();
    const isScrolledAway = x < its.left || x > its.right || y < its.top || y > its.bottom;
    if (isScrolledAway && getComputedStyle(outer).overflowY !== 'visible') return null;
  }
  // What sticks to the top of a list lies over what is scrolled below it.
  if (top.closest('.lights-tools, .panel-head, dialog, .toast, .banner')) return null;
  return top;
}
