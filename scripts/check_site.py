# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Check contrast and names of the built site with axe-core: scripts/check_site.py [FOLDER].

Needs Chromium with its driver, selenium, and `npm install --global axe-core`. Without one of them
nothing is checked. Every page is opened wide and light, then narrow and dark.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from headless_browser import Browser, find_browser

CHECKOUT_ROOT = Path(__file__).resolve().parent.parent
PAGE_VIEWS = ((1320, 1000, 'light'), (390, 844, 'dark'))
AXE_SCRIPT = """
const done = arguments[0];
axe.run(document, { preload: false, resultTypes: ['violations'] }).then(({ violations }) => done(
  violations.filter(({ impact }) => ['serious', 'critical'].includes(impact))
    .flatMap(({ id, nodes }) => nodes.map(({ target }) => `${id}: ${target.join(' ')}`))));
"""


def find_axe() -> Path | None:
    """Return the script of axe-core, None if npm has not installed it."""
    if shutil.which('npm') is None:
        return None
    command = ['npm', 'root', '--global']
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=60)
    script = Path(done.stdout.strip(), 'axe-core', 'axe.min.js')
    return script if script.exists() else None


def find_violations(browser: Browser, page: Path, axe: str) -> list[str]:
    """Return the serious violations of a page, a line each."""
    lines = []
    for width, height, scheme in PAGE_VIEWS:
        browser.resize(width, height)
        features = [{'name': 'prefers-color-scheme', 'value': scheme}]
        browser.driver.execute_cdp_cmd('Emulation.setEmulatedMedia', {'features': features})
        browser.open(page.as_uri())
        browser.driver.execute_script(axe)
        violations = browser.driver.execute_async_script(AXE_SCRIPT)
        lines += [f'{page.name}, {scheme}, {width} px: {line}' for line in violations]
    return lines


def main(folder: Path) -> int:
    """Check all pages; return 1 if one has a violation."""
    axe, (binary, driver) = find_axe(), find_browser()
    if axe is None or binary is None or driver is None:
        print('The pages were not checked: install chromium, chromium-driver and npm axe-core.')
        return 0
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(binary, driver, Path(profile))
        browser.driver.set_script_timeout(180.0)  # axe takes long on a busy machine
        try:
            text = axe.read_text(encoding='utf-8')
            pages = [page for page in folder.rglob('*.html') if '_modules' not in page.parts]
            lines = [
                line for page in sorted(pages) for line in find_violations(browser, page, text)
            ]
        finally:
            browser.driver.quit()
    print('\n'.join(lines) or f'axe-core found no serious violation in {len(pages)} pages.')
    return 1 if lines else 0


if __name__ == '__main__':
    sys.exit(main(Path(sys.argv[1]) if len(sys.argv) > 1 else CHECKOUT_ROOT / 'docs' / '_build'))
