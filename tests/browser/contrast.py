"""Contrast of the texts on a page, from the styles that the browser computes.

Web Content Accessibility Guidelines 2.2, success criterion 1.4.3.
"""

from __future__ import annotations

from playwright.sync_api import Page

LEAST = 4.5
"""Least contrast of a text."""
TEXTS = """(pictures) => {
  const numbers = (text) => (text.match(/[\\d.]+/g) || []).map(Number);
  const colour = (text) => {
    const [r, g, b, a = 1] = numbers(text);
    return [r, g, b, a];
  };
  const over = ([r, g, b, a], under) => [r, g, b].map((c, i) => a * c + (1 - a) * under[i]);
  const luminance = (rgb) => [0.2126, 0.7152, 0.0722].reduce((sum, weight, i) => {
    const c = rgb[i] / 255;
    return sum + weight * (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  }, 0);
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, element = node.parentElement;
    if (!node.textContent.trim() || !element.checkVisibility({ visibilityProperty: true }) || element.closest('script, style')) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect();
    if (!box.width || !box.height) continue;
    const chain = [];
    for (let each = element; each; each = each.parentElement) chain.push(each);
    const style = getComputedStyle(element);
    const opacity = chain.reduce((product, each) => product * Number(getComputedStyle(each).opacity), 1);
    if (opacity === 0) continue;
    const [r, g, b, a] = colour(element instanceof SVGElement ? style.fill : style.color);
    const ratios = pictures.map((picture) => {
      const ground = chain.reduceRight((under, each) => over(colour(getComputedStyle(each).backgroundColor), under), picture);
      const [one, other] = [luminance(over([r, g, b, a * opacity], ground)), luminance(ground)];
      return (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
    });
    found.push([Math.min(...ratios), node.textContent.trim().slice(0, 40), element.tagName + (element.id && '#' + element.id)]);
  }
  return found;
}"""


def faint_texts(tab: Page, behind: list[list[int]]) -> list[tuple[float, str, str]]:
    """Texts below `LEAST`, with their contrast and their element.

    Args:
        tab: The page.
        behind: Colours that may lie behind all, red, green, blue: the lowest contrast counts.
    """
    texts = tab.evaluate(TEXTS, behind)
    assert len(texts) > 5
    return [(round(ratio, 2), text, element) for ratio, text, element in texts if ratio < LEAST]
