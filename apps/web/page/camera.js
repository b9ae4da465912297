// The camera of this device.

export class Camera {
  constructor(video, select, label) {
    Object.assign(this, { video, select, label, stream: null });
    select.addEventListener("change", () => this.start());
  }

  /** Asks for the camera; throws an Error that says what to do. */
  async start() {
    if (!navigator.mediaDevices?.getUserMedia) {
      throw new Error("This page may not use the camera, because it was not opened by https or on this computer. Choose a picture instead.");
    }
    this.stop();
    const device = this.select.value ? { deviceId: { exact: this.select.value } } : { facingMode: "environment" };
    try {
      this.stream = await navigator.mediaDevices.getUserMedia({ audio: false, video: { ...device, width: { ideal: 1920 } } });
    } catch (error) {
      throw new Error(error.name === "NotFoundError" ? "This device has no camera. Choose a picture instead."
        : error.name === "NotAllowedError" ? "The camera is not allowed. Allow it for this page in the browser's settings, or choose a picture instead."
          : `The camera does not start: ${error.message}`);
    }
    this.video.srcObject = this.stream;
    await this.video.play();
    await this.listDevices();
  }

  async listDevices() {
    const cameras = (await navigator.mediaDevices.enumerateDevices()).filter(({ kind }) => kind === "videoinput");
    const used = this.stream.getVideoTracks()[0].getSettings().deviceId;
    this.select.replaceChildren(...cameras.map(({ deviceId, label }, i) => new Option(label || `Camera ${i + 1}`, deviceId, false, deviceId === used)));
    this.label.hidden = cameras.length < 2;
  }

  stop() {
    for (const track of this.stream?.getTracks() ?? []) track.stop();
    this.stream = null;
    this.video.srcObject = null;
  }

  /** The picture of now. */
  async takePicture() {
    if (!this.stream) await this.start();
    return createImageBitmap(this.video);
  }
}
