"""The page while a light is dragged: each frame it draws once, and only what has changed."""

from typing import Any


def test_drafts_become_coarser_until_ten_answers_a_second_come(page: Any):
    steps = page.evaluate(
        """async () => {
          const { DraftPace } = await import('/ui/lamp_moves.js');
          const run = (period, count, minStep) => {
            const pace = new DraftPace();
            for (let k = 0; k < count; k++) {
              pace.nextStep(minStep);
              pace.noteAnswer(k * period);
            }
            return pace.step;
          };
          return [run(99, 50, 1), run(101, 5, 1), run(400, 50, 2), run(2000, 50, 1), run(50, 5, 3)];
        }"""
    )
    # In time; too slow once; always too slow; the hand rests in between; a page that draws slowly.
    assert steps == [1, 2, 3, 1, 3]


def test_a_draft_repeats_its_pixels(page: Any):
    whole = page.evaluate(
        """async () => {
          const { repeatPixels } = await import('/viewer/drawing/coarse_planes.js');
          const halves = Uint16Array.from({ length: 18 }, (_, k) => k);
          return [...repeatPixels(halves, 2, [3, 5])];
        }"""
    )
    row = [[0, 1, 2], [0, 1, 2], [3, 4, 5], [3, 4, 5], [6, 7, 8]]
    low = [[channel + 9 for channel in pixel] for pixel in row]
    assert whole == [value for line in (row, row, low) for pixel in line for value in pixel]


RENDERINGS = """async () => {
  const { html, render } = await import('/vendor/preact.js');
  const { watched } = await import('/ui/watched_panel.js');
  const root = document.createElement('div');
  const seen = [];
  let press = null;
  const Child = ({ ui }) => html`<i>${ui.child}</i>`;
  const Panel = watched(({ ui, other }) => {
    seen.push(`${ui.shown} ${other}`);
    press = () => ui.pressed;
    return html`<b>${ui.shown}</b><${Child} ui=${ui} />`;
  });
  const show = (ui, other) => render(html`<${Panel} ui=${ui} other=${other} />`, root);
  const first = { shown: 1, child: 1, pressed: 1, unread: 1 };
  show(first, 'a');
  show({ ...first, unread: 2 }, 'a');
  const afterUnread = seen.length;
  show({ ...first, pressed: 2 }, 'a');
  const pressed = press();
  const afterPressed = seen.length;
  show({ ...first, child: 2 }, 'a');
  const afterChild = [seen.length, root.textContent];
  show({ ...first, child: 2 }, 'b');
  const afterOther = seen.length;
  show({ ...first, child: 2, shown: 3 }, 'b');
  const text = root.textContent;
  return { afterUnread, pressed, afterPressed, afterChild, afterOther, seen, text };
}"""


def test_a_panel_renders_again_for_what_it_has_read_alone(page: Any):
    result = page.evaluate(RENDERINGS)
    assert result["afterUnread"] == 1
    assert result["pressed"] == 2  # a handler reads the state of now, though nothing was rendered
    assert result["afterPressed"] == 1
    assert result["afterChild"] == [2, "12"]
    assert result["afterOther"] == 3
    assert result["seen"] == ["1 a", "1 a", "1 b", "3 b"]
    assert result["text"] == "32"


def test_panels_follow_several_messages_of_a_frame_at_once(page: Any):
    counts = page.evaluate(
        """async () => {
          const { Store } = await import('/ui/ui_store.js');
          const store = new Store({ a: 0, b: 0 });
          const seen = [];
          store.listen(() => seen.push({ ...store.value }));
          store.setForFrame({ a: 1 });
          await Promise.resolve();
          store.setForFrame({ b: 1 });
          const before = seen.length;
          await new Promise((resolve) => requestAnimationFrame(resolve));
          store.setForFrame({ a: 2 });
          store.set({ b: 2 });
          await Promise.resolve();
          await Promise.resolve();
          const atOnce = seen.length;
          await new Promise((resolve) => requestAnimationFrame(resolve));
          return { before, atOnce, seen };
        }"""
    )
    assert counts == {"before": 0, "atOnce": 2, "seen": [{"a": 1, "b": 1}, {"a": 2, "b": 2}]}


def test_a_change_that_can_wait_is_shown_with_the_next_or_soon(page: Any):
    seen = page.evaluate(
        """async () => {
          const { Store } = await import('/ui/ui_store.js');
          const store = new Store({ a: 0, b: 0 });
          const seen = [], frame = () => new Promise((done) => requestAnimationFrame(done));
          store.listen(() => seen.push({ ...store.value }));
          store.setWithNext({ a: 1 });
          await frame();
          store.flushFrame(); // of a frame that no change waits for
          const waiting = seen.length;
          store.setForFrame({ b: 1 });
          await frame();
          const withNext = seen.length;
          store.setWithNext({ a: 2 });
          await new Promise((done) => store.listen(done));
          return { waiting, withNext, seen };
        }"""
    )
    assert (seen["waiting"], seen["withNext"]) == (0, 1)
    assert seen["seen"] == [{"a": 1, "b": 1}, {"a": 2, "b": 1}]


LOADS = """async ({ isDropped }) => {
  const { PictureLoader } = await import('/engine/picture_loader.js');
  const { LightDrafts } = await import('/engine/session_mirror.js');
  const fetched = [], used = [];
  const host = { fetch: async (name) => (fetched.push(name), { data: new Uint16Array(3) }) };
  const loader = new PictureLoader(host, (...fields) => used.push(fields.slice(0, 2)), () => {});
  loader.setWanted([['plane 0', 'clean/0']]);
  const drafts = new LightDrafts(loader);
  const resources = { 'clean/0': 5, 'plane/0': 5 };
  const arrays = { data: { data: new Uint16Array(3) } };
  drafts.add({ light: 0, step: 1, resources, arrays }, [1, 1]);
  if (isDropped) drafts.clear();
  loader.addResources(resources);
  const early = [...used];
  drafts.show();
  await new Promise((done) => setTimeout(done));
  return { fetched, early, used };
}"""


def test_a_draft_is_shown_with_its_answer_and_not_fetched_as_well(page: Any):
    assert page.evaluate(LOADS, {"isDropped": False}) == {
        "fetched": [],
        "early": [],
        "used": [["plane 0", "clean/0"]],
    }


def test_a_draft_that_is_dropped_is_fetched(page: Any):
    loads = page.evaluate(LOADS, {"isDropped": True})
    assert loads["fetched"] == ["clean/0"]
    assert loads["used"] == [["plane 0", "clean/0"]]
