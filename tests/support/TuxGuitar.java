import java.io.ByteArrayInputStream;
import java.io.FileOutputStream;
import java.nio.file.Files;
import java.nio.file.Path;
import org.herac.tuxguitar.io.base.TGSongReaderHandle;
import org.herac.tuxguitar.io.base.TGSongStreamContext;
import org.herac.tuxguitar.io.base.TGSongWriterHandle;
import org.herac.tuxguitar.io.gtp.GP5InputStream;
import org.herac.tuxguitar.io.gtp.GTPSettings;
import org.herac.tuxguitar.io.midi.MidiSongReader;
import org.herac.tuxguitar.io.musicxml.MusicXMLSongWriter;
import org.herac.tuxguitar.song.factory.TGFactory;

/* TuxGuitar's own readers and its writer of MusicXML, without a window: its program has no command line for them. */
public class TuxGuitar {
    public static void main(String[] names) throws Exception {
        TGSongReaderHandle read = new TGSongReaderHandle();
        read.setFactory(new TGFactory());
        read.setContext(new TGSongStreamContext());
        read.setInputStream(new ByteArrayInputStream(Files.readAllBytes(Path.of(names[0]))));
        (names[0].endsWith(".mid") ? new MidiSongReader() : new GP5InputStream(new GTPSettings())).read(read);
        TGSongWriterHandle write = new TGSongWriterHandle();
        write.setFactory(read.getFactory());
        write.setContext(new TGSongStreamContext());
        write.setSong(read.getSong());
        try (FileOutputStream out = new FileOutputStream(names[1])) {
            write.setOutputStream(out);
            new MusicXMLSongWriter().write(write);
        }
    }
}
