"""The live page in a headless Chromium: what is drawn, what a click does.

    python tests/page_test.py

Chromium (Debian's `chromium`) takes 400 MB and is not installed by `make setup`: without it the tests are skipped.
"""
import asyncio
import unittest

from browser import CHROMIUM, Browser
from view_test import WAIT_S, Watched

STATE = "document.querySelector('#state').textContent"
GROUPS = "[...new Set([...scene.layers.values()].map((layer) => layer.group))]"


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
                await page.until(f"document.querySelector('#rate').textContent.startsWith('frame {number},')")
                await page.until(f"{STATE}.startsWith('paused; ')")
            self.assertEqual(await page.value("history.points.length"), 3, "each frame once")
            await page.click("[data-service=resume]")
            await page.until(f"!{STATE}.includes('paused')")
        run = self.see(look, "--view-paused")
        run.communicate(timeout=WAIT_S)
        self.assertEqual(run.returncode, 0)

    def test_it_fits_a_phone(self):
        async def look(page):
            await page.until(f"{STATE}.includes('ended')")
            await page.choose("#surfaces", "classes")
            await page.until("!document.querySelector('#classes').hidden")
            self.assertLessEqual(await page.value("document.documentElement.scrollWidth"), 390)
        self.end(self.see(look, "--view-stay", width=390, height=844, dark=True))

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
