// A custom element for articles: <live-bass link="like=slap&amp;action=-1"></live-bass> shows a small page of this export;
// page="livebass.html" names one in a single file.
(() => {
  const script = /** @type {HTMLScriptElement} */ (document.currentScript), home = script.src;
  customElements.define("live-bass", class extends HTMLElement {
    connectedCallback() {
      const frame = document.createElement("iframe"), link = this.getAttribute("link") || "";
      const page = new URL(`${this.getAttribute("page") || "./"}?embed`, home);
      Object.assign(frame, {src: `${page}#${link}`, title: this.title || "livebass", allow: "autoplay; midi", loading: "lazy"});
      frame.style.cssText = "border: 0; width: 100%; max-width: 60rem; height: 340px";
      this.replaceChildren(frame);
    }
  });
})();
