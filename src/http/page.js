for (const host of document.querySelectorAll(".host")) host.textContent = location.origin;
