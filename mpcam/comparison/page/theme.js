// The button that switches between light and dark colors; the choice is remembered where the browser allows it.
function startTheme() {
  const button = document.getElementById("theme"), root = document.documentElement;
  const prefersDark = matchMedia("(prefers-color-scheme: dark)");
  const store = (value) => { try { localStorage.setItem("mpcam-theme", value); } catch { /* pages from files may not */ } };
  const stored = () => { try { return localStorage.getItem("mpcam-theme"); } catch { return null; } };
  const dark = () => (root.dataset.theme ? root.dataset.theme === "dark" : prefersDark.matches);
  const name = () => {
    button.textContent = dark() ? "Light" : "Dark";
    button.setAttribute("aria-label", `Switch to ${dark() ? "light" : "dark"} colors`);
  };
  if (["light", "dark"].includes(stored())) root.dataset.theme = stored();
  button.addEventListener("click", () => {
    root.dataset.theme = dark() ? "light" : "dark";
    store(root.dataset.theme);
    name();
  });
  prefersDark.addEventListener("change", name);
  name();
}
