// What the build fills into the service worker: [name, bytes, integrity] of files.
type Listed = [name: string, bytes: number, integrity: string];
declare const __FILES__: Listed[];
declare const __RUNTIME__: Listed[];
declare const __IMMUTABLE__: string[];

/** A file of Python's, as the page names it. */
interface RuntimeFile {
  name: string;
  size: number;
  sha256: string;
  holds?: string[];
}

/** Told of bytes as they come. */
type Count = (bytes: number) => void;

/** What of Pyodide's file system is used. */
interface FileSystem {
  mkdirTree(path: string): void;
  writeFile(path: string, bytes: Uint8Array, options: { canOwn: boolean }): void;
}

/** What of Pyodide is used. */
interface Pyodide {
  runPython(code: string): any;
  pyimport(name: string): { destroy(): void };
  FS: FileSystem;
  _module: { HEAPU8: Uint8Array };
}

/** What Python asks for of the files that were not loaded at the start, once an answer has failed for want of one. */
interface Rooms {
  wanted(): RuntimeFile | undefined;
  bring(file: RuntimeFile): Promise<unknown>;
}

/** The host's methods. */
type Answers = Record<"frame" | "job" | "give" | "forget", (request: string, data?: Uint8Array) => string>;

interface Start {
  runtime: string;
  files: RuntimeFile[];
  again?: boolean;
  known?: boolean;
  modules?: string[];
}

interface Question {
  type: "frame" | "job" | "give";
  id: number;
  request: string;
  data?: Uint8Array;
}
