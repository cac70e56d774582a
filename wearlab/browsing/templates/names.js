// Roles and names for what Bokeh leaves without: the handle of its slider, and the tools beside its figures.
(() => {
  const inside = (root) => [...root.querySelectorAll("*")].flatMap((e) => (e.shadowRoot ? [e, ...inside(e.shadowRoot)] : [e]));
  const given = (element, told) => Object.entries(told).forEach(([name, value]) => element.setAttribute(name, value));
  const name = () => {
    for (const element of inside(document)) {
      if (element.matches(".noUi-handle")) given(element, { "aria-label": "Wear state" });
      if (element.matches(".bk-OnOffButton")) given(element, { "aria-pressed": element.matches(".bk-active") });
      if (element.matches(".bk-OnOffButton, .bk-ClickButton")) given(element, { role: "button", "aria-label": element.title });
      if (element.matches(".bk-tool-overflow")) given(element, { role: "button", "aria-label": "More tools" });
      if (element.matches(".bk-events")) element.removeAttribute("tabindex"); // nothing is done there by keys
    }
  };
  setInterval(name, 500);
})();
