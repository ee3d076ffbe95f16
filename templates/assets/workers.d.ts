// What the build fills into the service worker: [name, bytes, integrity] of files.
declare const __FILES__: [string, number, string][];
declare const __RUNTIME__: [string, number, string][];
declare const __IMMUTABLE__: string[];
