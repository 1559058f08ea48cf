// The web socket: commands out, pictures and status in. It reconnects by itself.

const token = new URLSearchParams(location.search).get("token") ?? sessionStorage.getItem("wavetank token") ?? "";
if (token) sessionStorage.setItem("wavetank token", token);
// The token is removed from the address bar, and so from screenshots and the history.
if (location.search) history.replaceState(null, "", location.pathname);

const listeners = {};
let socket = null;
let wait = 250;
let run = ""; // identifies the run of the server that this page belongs to

/** Call `act` for every message of a type, and for "picture", "open" and "closed". */
export function on(type, act) {
  (listeners[type] ??= []).push(act);
}

/** Pass a message, or an event of the page, to all listeners. */
export function tell(type, value) {
  for (const act of listeners[type] ?? []) act(value);
}

/** Send a command; without a connection it is lost. */
export function send(command) {
  if (socket?.readyState === WebSocket.OPEN) socket.send(JSON.stringify(command));
}

/** Return the address of a file of the server, with the token. */
export function link(path) {
  return `${path}?token=${encodeURIComponent(token)}`;
}

/** Return whether the connection is open. */
export const pending = () => socket?.readyState === WebSocket.OPEN;

export function connect() {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  socket = new WebSocket(`${scheme}://${location.host}${link("/socket")}`);
  socket.binaryType = "blob";
  socket.onopen = () => { wait = 250; tell("open"); };
  socket.onmessage = ({ data }) => {
    if (data instanceof Blob) tell("picture", data);
    else {
      const message = JSON.parse(data);
      if (message.type === "hello") {
        const restarted = run && run !== message.run;
        run = message.run;
        tell("hello", message);
        if (restarted) tell("restarted");
      } else tell(message.type, message);
    }
  };
  socket.onclose = async () => {
    tell("closed");
    // A restarted server has another token and would refuse this page indefinitely.
    const now = await fetch("/page/run").then((answer) => (answer.ok ? answer.text() : ""), () => "");
    if (now && now !== run && !(await accepted())) { tell("refused", run !== ""); return; }
    setTimeout(connect, wait);
    wait = Math.min(4000, 1.6 * wait);
  };
}

/** Return whether the server accepts this page's token. */
const accepted = () => fetch(link("/"), { method: "HEAD" }).then((answer) => answer.ok, () => true);
