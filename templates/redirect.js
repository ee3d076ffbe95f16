
location.replace(document.querySelector("main a").href + location.search + location.hash);
