// SPDX-License-Identifier: Apache-2.0
// What is wider than the page and scrolls can be reached by keys, too.
addEventListener("load", () => {
  for (const box of document.querySelectorAll("article pre, article p, article .table-wrapper"))
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
});
