"""The live page in a headless Chromium: what is drawn, what a click does.

    python tests/page_test.py

Chromium (Debian's `chromium`) takes 400 MB and is not installed by `make setup`: without it the tests are skipped.
"""
import asyncio
import math
import unittest

from browser import CHROMIUM, Browser
from view_test import WAIT_S, Watched

STATE = "document.querySelector('#state').textContent"
GROUPS = "[...new Set([...scene.layers.values()].map((layer) => layer.group))]"

MOMENT = "document.querySelector('#moment').textContent"
REFUSED = ("Object.fromEntries([...document.querySelectorAll('#drive button')].filter((b) => b.disabled)"
           ".map((b) => [b.dataset.service, b.title]))")
BEYOND = ("[...document.querySelectorAll('body *')].filter((e) => e.getBoundingClientRect().right > innerWidth + 1"
          " && !e.closest('#names')).map((e) => e.id || e.tagName)")
# Of the pane, by what is drawn in it: left, right, top, bottom, width, height.
REACH = """(() => {
    const p = scene.content().filter((q) => q[2] <= scene.cut).map((q) => scene.pixel(scene.inMap(q)));
    const x = p.map((q) => q[0]), y = p.map((q) => q[1]);
    return [Math.min(...x), Math.max(...x), Math.min(...y), Math.max(...y),
            scene.canvas.clientWidth, scene.canvas.clientHeight];
})()"""
# Of a box 0.4 by 0.6 by 1.6 m on a floor as the map lies, then on one that is tilted about x: its sides along its
# own axes, and how far up its longest edges go and its name stands over its middle, as shares of what they should.
BOXES = """[0, Math.PI / 6].map((tilt) => {
    const {level, lines} = scene;
    scene.level = {q: [Math.sin(tilt / 2), 0, 0, Math.cos(tilt / 2)], t: [0, 0, 0]};
    let drawn;
    scene.lines = (name, ends) => { drawn = ends; };
    const said = {id: 7, pose: {t: [1, 2, 3]}, scale: [0.4, 0.6, 1.6], colour: [1, 0, 0, 1], points: []};
    surroundings.drawBoxes([{...said, ns: 'objects'}, {...said, ns: 'names', text: 'person 7'}]);
    const up = turned(inverted(scene.level.q), [0, 0, 1]);
    const sides = [0, 4, 8].map((edge) => sub(drawn[2 * edge + 1], drawn[2 * edge]));
    const over = sub(surroundings.names[0].at, said.pose.t), lengths = sides.map((side) => Math.hypot(...side));
    Object.assign(scene, {level, lines});
    return [...lengths, Math.min(dot(sides[2], up) / lengths[2], dot(over, up) / Math.hypot(...over))];
})"""
# The next image takes longer to decode than the one after it.
FIRST_DECODES_LAST = """(() => {
    const decode = createImageBitmap;
    let asked = 0;
    window.decoded = 0;
    window.createImageBitmap = async (blob) => {
        const isFirst = asked++ === 0;
        while (isFirst && window.decoded < 1) await new Promise((done) => setTimeout(done, 20));
        const bitmap = await decode(blob);
        setTimeout(() => ++window.decoded);
        return bitmap;
    };
})()"""

# Four frames 50 ms apart, of which the second had no pose and the third an unsure one. Where each is on the scrubber:
# its colour there.
MARKS = """(() => {
    const frame = (n) => ({t: n / 20, frame: n, pose: null, lost: n === 1, unsure: n === 2, stages: [9, 2, 4], points: [1, 1, 1], age: 0});
    record.load([0, 1, 2, 3].map(frame));
    record.draw();
    const marks = $('marks'), scrub = $('scrub').getBoundingClientRect();
    const name = ([r, g, b, a]) => !a ? '' : ['--dynamic', '--unknown'].find((n) => colourOf(n).slice(0, 3).join() === [r, g, b].join());
    return [0, 1, 2, 3].map((n) => {
        const x = scrub.x - marks.getBoundingClientRect().x + 8 + n / 3 * (scrub.width - 16);
        return name(marks.getContext('2d').getImageData(Math.round(x), 1, 1, 1).data);
    });
})()"""


def tiles(group):
    return f"[...scene.layers.values()].filter((l) => l.group === '{group}' && l.count > 0).length"


@unittest.skipUnless(CHROMIUM, "no Chromium here")
class Page(Watched):
    def see(self, look, *options, **how):
        run, port, token = self.start(*options)

        async def browse():
            async with Browser(**how) as page:
                await page.open(f"http://127.0.0.1:{port}/#{token}")
                await look(page)
                self.assertEqual(page.complaints, [])
        asyncio.run(browse())
        return run

    def test_surfaces_are_a_mesh_its_classes_points_or_none(self):
        async def look(page):
            await page.until(f"{STATE}.includes('ended')")
            await page.until(f"{tiles('mesh')} > 2")
            meshed = await page.picture()
            self.assertNotIn("points", await page.value(GROUPS), "not asked for")
            await page.choose("#surfaces", "classes")
            await page.until("document.querySelector('#classes').textContent.includes('floor')")
            self.assertGreater(await page.value(tiles("classes")), 2)
            self.assertEqual(await page.value(tiles("mesh")), 0)
            named = await page.picture()
            await page.choose("#surfaces", "points")
            await page.until(f"{tiles('points')} === 1")
            self.assertTrue(await page.value("document.querySelector('#classes').hidden"))
            dotted = await page.picture()
            await page.choose("#surfaces", "none")
            await page.until(f"{tiles('points')} === 0")
            await asyncio.sleep(0.5)
            self.assertEqual(len({meshed, named, dotted, await page.picture()}), 4)
            await page.choose("#surfaces", "mesh")
            await page.until(f"{tiles('mesh')} > 2")
        self.end(self.see(look, "--view-stay"))

    def test_paused_is_shown_and_buttons_drive(self):
        async def look(page):
            await page.until(f"{STATE} === 'paused before the first frame'")
            for number in range(3):
                await page.click("[data-service=step]")
                await page.until(f"document.querySelector('#rate').textContent.startsWith('frame {number} ')")
                await page.until(f"{STATE}.startsWith('paused; ')")
            self.assertEqual(await page.value("record.entries.length"), 3, "each frame once")
            await page.click("[data-service=resume]")
            await page.until(f"!{STATE}.includes('paused')")
        run = self.see(look, "--view-paused")
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)

    def test_objects_stand_upright_with_their_names_on_them(self):
        async def look(page):
            await page.until(f"{STATE} === 'paused before the first frame'")
            self.assertFalse(await page.value("document.querySelector('#no-image').hidden"), "and none has come")
            upright, tilted = await page.value(BOXES)
            self.assertEqual([round(v, 6) for v in upright], [0.4, 0.6, 1.6, 1])
            # 30 degrees: what an ellipsoid of these sides reaches, and the share of the edge that is up.
            self.assertAlmostEqual(tilted[2], math.hypot(1.6 * math.cos(math.pi / 6), 0.6 * math.sin(math.pi / 6)))
            self.assertAlmostEqual(tilted[3], 1)
        run = self.see(look, "--view-paused")
        run.terminate()
        run.communicate(timeout=WAIT_S)

    def test_it_fits_a_phone(self):
        async def look(page):
            await page.until(f"{STATE}.includes('ended')")
            await page.choose("#surfaces", "classes")
            await page.until("!document.querySelector('#classes').hidden")
            await page.value("say('an answer that is longer than a phone is wide, as some are '.repeat(3))")
            self.assertLessEqual(await page.value("document.documentElement.scrollWidth"), 390)
            self.assertEqual(await page.value(BEYOND), [])
        self.end(self.see(look, "--view-stay", width=390, height=844, dark=True))

    def test_keys_drive_and_look_back(self):
        async def look(page):
            await page.until(f"{STATE} === 'paused before the first frame'")
            await page.until("!document.querySelector('#play').disabled")
            for number in range(4):
                await page.press("ArrowRight")
                await page.until(f"record.entries.at(-1).frame === {number}")
                await page.until(f"{STATE}.startsWith('paused; ')")
                await page.until("Math.abs(image.kept.at(-1).stamp - record.entries.at(-1).t) < 1e-3")
            await page.press("ArrowLeft")
            self.assertEqual(await page.value("record.cursor"), 2)
            self.assertIn("frame 2", await page.value(MOMENT))
            await page.press("Home")
            await page.press("ArrowRight")
            self.assertEqual(await page.value("record.cursor"), 1, "looking back it is no step")
            self.assertEqual(await page.value("record.entries.length"), 4)
            await page.until("Math.abs(image.shown - record.entries[1].t) < 1e-3")
            await page.value(FIRST_DECODES_LAST)
            await page.press("ArrowLeft")
            await page.press("ArrowRight")
            await page.until("decoded === 2")
            self.assertLess(await page.value("Math.abs(image.shown - record.entries[1].t)"), 1e-3)
            await page.press("End")
            self.assertIsNone(await page.value("record.cursor"))
            await page.press(" ")
            await page.until(f"!{STATE}.includes('paused')")
        run = self.see(look, "--view-paused")
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)

    def test_who_comes_late_sees_the_way_and_the_curves(self):
        async def look(page):
            await page.until("!document.querySelector('#play').disabled")
            for number in range(5):
                await page.press("ArrowRight")
                await page.until(f"record.entries.length === {number + 1}")
            before = await page.value("record.entries")
            await page.send("Page.reload")
            await page.until("record.entries.length === 5")
            after = await page.value("record.entries")
            for a, b in zip(before, after):
                self.assertEqual((a["frame"], a["points"], a["age"]), (b["frame"], b["points"], b["age"]))
                self.assertAlmostEqual(a["t"], b["t"], places=3)
                for i in range(3):
                    self.assertAlmostEqual(a["pose"]["t"][i], b["pose"]["t"][i], places=4)
                    self.assertAlmostEqual(a["stages"][i], b["stages"][i], delta=0.01)
            await page.until("scene.layers.get('way').count === 4")
            self.assertFalse(await page.value("document.querySelector('#scrub').disabled"))
        self.end(self.see(look, "--view-paused"))

    def test_what_cannot_be_done_is_disabled_and_says_why(self):
        async def look(page):
            await page.until("!document.querySelector('#play').disabled")
            refused = await page.value(REFUSED)
            self.assertEqual(list(refused), ["save"])
            self.assertIn("--save-map", refused["save"])
            await page.press(" ")
            await page.until(f"{STATE}.includes('ended')")
            refused = await page.value(REFUSED)
            self.assertEqual(set(refused.values()), {"the run has ended"})
            self.assertEqual(set(refused), {"pause", "step", "slower", "faster", "save", "reset"})
        self.end(self.see(look, "--view-paused", "--view-stay"))

    def test_an_onlooker_is_told_what_driving_needs(self):
        run, port, _ = self.start("--view-paused")

        async def browse():
            async with Browser() as page:
                await page.open(f"http://127.0.0.1:{port}/")
                await page.until(f"{STATE}.includes('paused')")
                await page.until("document.querySelector('#play').title.includes('token')")
                self.assertEqual(len(await page.value(REFUSED)), 7)
        asyncio.run(browse())
        self.end(run)

    def test_the_scrubber_tells_where_the_pose_was_lost_or_unsure(self):
        async def look(page):
            await page.until(f"{STATE} === 'paused before the first frame'")
            self.assertEqual(await page.value(MARKS), ["", "--dynamic", "--unknown", ""])
            self.assertAlmostEqual(await page.value("record.period_ms"), 50)
            self.assertEqual(await page.value("summed(record.entry.stages)"), [9, 11, 15])
        self.end(self.see(look, "--view-paused"))

    def test_answers_move_nothing(self):
        async def look(page):
            await page.until("!document.querySelector('#play').disabled")
            places = ("['#scene', '#image', '#scrub', '#play'].map((s) => "
                      "Object.values(document.querySelector(s).getBoundingClientRect().toJSON()))")
            before = await page.value(places)
            await page.click("[data-service=faster]")
            await page.until("document.querySelector('#said').textContent.includes('as fast as')")
            self.assertEqual(await page.value(places), before)
        self.end(self.see(look, "--view-paused"))

    def test_what_is_mapped_fills_the_pane(self):
        async def look(page):
            await page.until(f"{STATE}.includes('ended')")
            await page.until(f"{tiles('mesh')} > 2")
            await page.until("scene.goal === null && surroundings.floor === 0")
            await asyncio.sleep(2)
            left, right, top, bottom, width, height = await page.value(REACH)
            self.assertGreater(max((right - left) / width, (bottom - top) / height), 0.7)
            for end in (left / width, top / height, 1 - right / width, 1 - bottom / height):
                self.assertGreater(end, -0.02)
        self.end(self.see(look, "--view-stay"))

    def test_a_rendering_has_points_alone(self):
        run, port, token = self.start_command(
            "simulate", "walking_xyz", "--out", self.folder / "sim", "--seconds", "0.3", "--size",
            "160x120", "--view-paused")

        async def browse():
            async with Browser() as page:
                await page.open(f"http://127.0.0.1:{port}/#{token}")
                await page.until(f"{STATE}.includes('paused')")
                await page.click("[data-service=step]")
                await page.until(f"{tiles('points')} === 1")
                self.assertEqual(await page.value("document.querySelector('#surfaces').value"), "points")
                self.assertTrue(await page.value("document.querySelector('#surfaces').options[1].disabled"))
                self.assertEqual(page.complaints, [])
        asyncio.run(browse())
        self.end(run)


if __name__ == "__main__":
    unittest.main()
