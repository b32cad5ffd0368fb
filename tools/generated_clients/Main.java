import com.fasterxml.jackson.core.JsonProcessingException;
import com.fasterxml.jackson.databind.ObjectMapper;
import java.io.File;
import java.io.IOException;
import java.io.UncheckedIOException;
import java.nio.file.Files;
import java.nio.file.Path;
import java.util.Arrays;
import org.openapitools.client.ApiClient;
import org.openapitools.client.ApiException;
import org.openapitools.client.api.SessionsApi;
import org.openapitools.client.model.Box;
import org.openapitools.client.model.CreatedSession;
import org.openapitools.client.model.FrameAnswers;

/**
 * Tracks the frames of a folder with the Java client that openapi-generator generates: `URL FOLDER BOX SEED`.
 *
 * <p>It prints a line for each frame but the first: number, x, y, width, height, status.
 */
public final class Main {
  private Main() {}

  /**
   * Sends a file as its bytes. The client of the library `native` would write its path as JSON; the default one, with
   * okhttp, sends the bytes by itself.
   */
  private static final class FileMapper extends ObjectMapper {
    FileMapper() {
      super(ApiClient.createDefaultObjectMapper());
    }

    @Override
    public ObjectMapper copy() {
      return this;
    }

    @Override
    public byte[] writeValueAsBytes(Object value) throws JsonProcessingException {
      try {
        return value instanceof File file ? Files.readAllBytes(file.toPath()) : super.writeValueAsBytes(value);
      } catch (JsonProcessingException error) {
        throw error;
      } catch (IOException error) {
        throw new UncheckedIOException(error);
      }
    }
  }

  /** The program. */
  public static void main(String[] arguments) throws Exception {
    var client = new ApiClient();
    client.updateBaseUri(arguments[0]);
    client.setObjectMapper(new FileMapper());
    var sessions = new SessionsApi(client);
    var folder = Path.of(arguments[1]);
    File[] frames = folder.toFile().listFiles((where, name) -> name.endsWith(".jpg"));
    Arrays.sort(frames);
    String box = arguments[2];
    long seed = Long.parseLong(arguments[3]);
    CreatedSession session = sessions.createSession(frames[0], box, null, null, seed, null, null, null);
    long started = System.nanoTime();
    for (int number = 1; number < frames.length; number++) {
      FrameAnswers answer = sessions.postFrames(session.getId(), frames[number], (long) number, null);
      Box at = answer.getBox();
      System.out.println(
          answer.getFrame() + " " + at.getX() + " " + at.getY() + " " + at.getWidth() + " " + at.getHeight() + " "
              + answer.getStatus());
    }
    System.err.println((System.nanoTime() - started) / 1e6 / (frames.length - 1));
    // A seed that the service draws has up to 53 bits.
    CreatedSession drawn = sessions.createSession(frames[0], box, null, null, null, null, true, null);
    if (drawn.getParameters().getSeed() < 0) {
      throw new IllegalStateException("a negative seed");
    }
    Path text = Files.writeString(folder.resolve("no picture"), "\0 no picture");
    try {
      sessions.postFrames(session.getId(), text.toFile(), null, null);
      throw new IllegalStateException("no picture was taken");
    } catch (ApiException error) {
      if (error.getCode() != 415 || !error.getResponseBody().contains("/docs/problems#unsupported-image")) {
        throw error;
      }
    }
    sessions.deleteSession(session.getId());
    sessions.deleteSession(drawn.getId());
  }
}
